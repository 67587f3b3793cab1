"""One task of a fleet, done in a worker: a recording set in, a row of results out, whatever is wrong with the set."""

from __future__ import annotations

import os
import re
import resource
import socket
import tempfile
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import fsspec
from threadpoolctl import threadpool_limits

import bristle as br
from bristle.fleet.items import FleetItem
from bristle.fleet.rows import WORK
from identification import one_thread
from recordings import BadInput, BristleError

Row = dict[str, Any]
"""A row of results: numbers, texts and truth values by name of the column, None for what is not known."""

SETTLED = ("done", "negative", "refused")
"""States that the same content would give again; ``failed`` is tried again."""


def analysed(what: str, item: FleetItem, options: Mapping[str, Any], key: str, pages: str | None) -> Row:
    """The row of a recording set. It raises nothing that a recording can cause.

    what : ``fit``, ``trace``, ``assess`` or ``test``; options : of that command; pages : folder for the valve's page.
    One thread does it: the other cores have valves of their own.
    """
    started = time.perf_counter()
    row: Row = {"valve": item.valve, "type": item.kind, "date": item.date, "recordings": ";".join(item.recordings)}
    row |= {"key": key, "state": "done", "sentence": "", "page": None}
    try:
        with one_thread(), threadpool_limits(limits=1), _here(item.recordings) as paths:
            found, values, sentence = WORK[what](paths, {**options, **item.own})
            row |= values | {"date": item.date or _dated(paths), "sentence": sentence}
            if pages is not None:
                row["page"] = _page(Path(pages), item, key)
                found.report(Path(pages) / str(row["page"]))
    except br.NegativeAnswer as error:
        row |= {"state": "negative", "sentence": str(error)}
    except BristleError as error:
        row |= {"state": "refused", "sentence": str(error)}
    except Exception as error:  # a defect of ours must not stop the fleet either; its row says what it was
        row |= {"state": "failed", "sentence": f"{type(error).__name__}: {error}"}
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0
    row |= {"seconds": time.perf_counter() - started, "worker": f"{socket.gethostname()}:{os.getpid()}"}
    return row | {"worker_memory_MB": memory}


@contextmanager
def _here(urls: tuple[str, ...]) -> Iterator[list[Path]]:
    """The files as paths; what is elsewhere is copied for as long as it is needed. Raises BadInput."""
    with tempfile.TemporaryDirectory(prefix="bristle-fleet-") as folder:
        yield [_fetched(url, Path(folder) / str(number)) for number, url in enumerate(urls)]


def _fetched(url: str, folder: Path) -> Path:
    if "://" not in url:
        return Path(url)
    try:
        system, place = fsspec.core.url_to_fs(url)
        folder.mkdir()
        there = folder / place.rsplit("/", 1)[-1]
        system.get_file(place, str(there))
    except (OSError, ValueError, ImportError) as error:
        raise BadInput(url, f"it cannot be fetched ({error})", "check the URL, and the access to it") from None
    return there


def _dated(paths: list[Path]) -> str | None:
    """When the first recording was made, as it says itself."""
    if paths[0].suffix not in (".h5", ".hdf5"):
        return None
    created = br.read(paths[0]).created
    return None if created is None else created.isoformat(timespec="seconds")


def _page(folder: Path, item: FleetItem, key: str) -> str:
    """The name of the valve's page."""
    folder.mkdir(parents=True, exist_ok=True)
    return f"{re.sub(r'[^A-Za-z0-9._-]+', '_', item.valve)[:80].strip('.')}-{key[:8]}.html"
