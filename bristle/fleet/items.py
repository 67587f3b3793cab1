"""What a fleet consists of: recording sets, from a folder or from a table, on any file system of fsspec."""

from __future__ import annotations

import csv
import hashlib
import io
import json
import posixpath
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

import fsspec

import bristle as br
from recordings import BadInput

RECORDING = (".h5", ".hdf5")
HISTORIAN = (".csv", ".tsv", ".mat", ".parquet")
"""What `assess` takes as well."""

COLUMNS = ("valve", "recordings", "type", "date")
"""Columns of a table; the first two are needed."""


@dataclass(frozen=True)
class FleetItem:
    """A recording set: what is one task.

    valve : tag; recordings : paths or URLs, worked on together; kind : the type of valve, empty where not known; date :
    ISO 8601, None where the recording is to say it; mark : of the content of the files as the file system tells it;
    own : options of this set alone, by name.
    """

    valve: str
    recordings: tuple[str, ...]
    kind: str = ""
    date: str | None = None
    mark: str = ""
    own: Mapping[str, str] = field(default_factory=dict)

    def key(self, what: str, options: Mapping[str, Any]) -> str:
        """Names the result: the same work on the same content, by the same version of Bristle, has the same key."""
        known = [
            br.__version__,
            what,
            dict(options),
            self.valve,
            self.recordings,
            self.kind,
            self.date,
            self.mark,
            dict(self.own),
        ]
        return hashlib.sha256(json.dumps(known, sort_keys=True, default=str).encode()).hexdigest()[:20]


def fleet_items(source: str, what: str) -> list[FleetItem]:
    """The recording sets of a folder or a table, in the order of valve and file.

    In a folder, every file is a set of its own: ``DIR/FV-101.h5`` is of the valve FV-101, and so is
    ``DIR/FV-101/2025-03-01.h5``. A table (CSV or Parquet) has the columns ``valve`` and ``recordings``, and may have
    ``type``, ``date`` and options of the command; several recordings of a set are separated by ``;``.

    Raises BadInput when there is no such thing, or nothing in it.
    """
    system, root = _opened(source)
    try:
        if system.isdir(root):
            found = list(_of_folder(system, root, what))
        elif system.exists(root):
            found = list(_of_table(system, root, source))
        else:
            raise BadInput(source, "there is no such folder or table", "check the path or the URL")
    except OSError as error:
        raise BadInput(source, f"it cannot be read ({error})", "check the path, and the access to it") from None
    if not found:
        raise BadInput(source, "there are no recordings in it", f"a recording ends in {' or '.join(RECORDING)}")
    return sorted(found, key=lambda item: (item.valve, item.recordings))


def _opened(source: str) -> tuple[Any, str]:
    try:
        system, root = fsspec.core.url_to_fs(source)
    except (ValueError, ImportError) as error:
        remedy = "give a path, or a URL of a file system that fsspec knows and whose library is installed"
        raise BadInput(source, f"it cannot be opened ({error})", remedy) from None
    return system, root.rstrip("/") or root


def _of_folder(system: Any, root: str, what: str) -> Iterator[FleetItem]:
    wanted = (*RECORDING, *HISTORIAN) if what == "assess" else RECORDING
    for path in sorted(system.find(root)):
        name = posixpath.relpath(path, root)
        stem, ending = posixpath.splitext(name)
        if ending in wanted and not any(part.startswith(".") for part in name.split("/")):
            yield FleetItem(posixpath.dirname(name) or stem, (_url(system, path),), mark=_mark(system, path))


def _of_table(system: Any, root: str, source: str) -> Iterator[FleetItem]:
    for number, row in enumerate(_rows(system, root, source), 2):
        valve, files = row.get("valve"), row.get("recordings")
        if not valve or not files:
            missing = "valve" if not valve else "recordings"
            raise BadInput(f"{source}: row {number}: {missing}", "it is empty", f"a table has {', '.join(COLUMNS)}")
        paths = tuple(_placed(system, root, one.strip()) for one in files.split(";"))
        mark = "".join(_mark(*_opened(path)) for path in paths)
        own = {name: value for name, value in row.items() if name not in COLUMNS and value}
        yield FleetItem(valve, paths, row.get("type") or "", row.get("date") or None, mark, own)


def _rows(system: Any, root: str, source: str) -> list[dict[str, str]]:
    with system.open(root, "rb") as file:
        content = file.read()
    if root.endswith(".parquet"):
        import pyarrow.parquet

        table = pyarrow.parquet.read_table(io.BytesIO(content)).to_pylist()
        return [{name: "" if value is None else str(value) for name, value in row.items()} for row in table]
    try:
        reader = csv.DictReader(io.StringIO(content.decode("utf-8-sig")), strict=True)
        rows = [{name: value or "" for name, value in row.items() if name} for row in reader]
    except (UnicodeDecodeError, csv.Error) as error:
        raise BadInput(source, f"it is no table ({error})", "give a folder, or a table in CSV or Parquet") from None
    for name in COLUMNS[:2]:
        if name not in (reader.fieldnames or ()):
            raise BadInput(source, f"it has no column {name!r}", f"a table has {', '.join(COLUMNS)}")
    return rows


def _placed(system: Any, root: str, path: str) -> str:
    """A path of a table, which is relative to the table."""
    if "://" in path or posixpath.isabs(path):
        return path
    return _url(system, posixpath.join(posixpath.dirname(root), path))


def _url(system: Any, path: str) -> str:
    """How a worker finds it: a plain path on a local file system."""
    return path if _local(system) else str(system.unstrip_protocol(path))


def _local(system: Any) -> bool:
    return "file" in (system.protocol if isinstance(system.protocol, tuple | list) else (system.protocol,))


def _mark(system: Any, path: str) -> str:
    """What changes with the content: size and time of change, or what else the file system has. Empty for no file."""
    try:
        facts = system.info(path)
    except (OSError, ValueError):
        return ""
    changed = next((facts[name] for name in ("mtime", "ETag", "LastModified", "created") if facts.get(name)), None)
    return hashlib.sha256(f"{facts.get('size')} {changed}".encode()).hexdigest()[:16]
