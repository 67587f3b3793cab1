"""The results of a fleet: a Parquet table, and a journal in which each result is safe as soon as it is there."""

from __future__ import annotations

import fcntl
import json
import math
import os
import time
from collections.abc import Iterable, Mapping
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import pyarrow
import pyarrow.parquet

from bristle.fleet.work import SETTLED, Row
from recordings import BadInput

FIRST = ("valve", "type", "date", "state", "sentence", "page", "recordings")
LAST = ("seconds", "worker", "worker_memory_MB", "key")
"""Columns that stand before and behind those of the work."""

EVERY_S = 20.0
"""How often the table is written while results come [s]; in between they are in the journal."""

MADE_BY = b"bristle-fleet"


class FleetResults:
    """The table at `path` while a fleet is worked on. Context manager: leaving it writes the table, the journal ends.

    what : the kind of work; a table of another kind is refused. Results are kept by key: what is there already is in
    `rows`. Raises BadInput for a file that is no such table, and while another process writes it.
    """

    def __init__(self, path: Path, what: str) -> None:
        self.path, self.what = path, what
        self.rows: dict[str, Row] = {}
        self._journal = Path(f"{path}.journal")
        self._written = 0.0

    def __enter__(self) -> Self:
        if not self.path.parent.is_dir():
            raise BadInput(str(self.path), f"there is no folder {self.path.parent}", "create it, or name another")
        self._file = self._journal.open("a+b")
        try:
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            self.rows |= {row["key"]: row for row in read_results(self.path, self.what)} if self.path.exists() else {}
            self.rows |= {row["key"]: row for row in self._journalled()}
        except BlockingIOError:
            self._file.close()
            raise BadInput(str(self.path), "another fleet is being written there", "wait for it") from None
        except BaseException:
            if not self._journal.stat().st_size:
                self._journal.unlink()
            self._file.close()
            raise
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        try:
            self.write()
            self._journal.unlink()
        finally:
            self._file.close()

    def whole(self) -> list[Row]:
        """All rows, each with all columns, in the order of valve, date and recordings."""
        names = dict.fromkeys(name for row in self.rows.values() for name in row)
        rows = [{name: row.get(name) for name in names} for row in self.rows.values()]
        return sorted(rows, key=lambda row: (row["valve"], row["date"] or "", row["recordings"]))

    def settled(self, key: str) -> bool:
        """Whether a result is there that the same work would give again."""
        return key in self.rows and self.rows[key]["state"] in SETTLED

    def keep(self, keys: Iterable[str]) -> int:
        """Forget the results of all other keys; returns how many those were."""
        wanted = set(keys)
        others = [key for key in self.rows if key not in wanted]
        for key in others:
            del self.rows[key]
        return len(others)

    def add(self, row: Row) -> None:
        """Keep a result: it outlives this process from now on."""
        plain = {name: _plain(value) for name, value in row.items()}
        self.rows[plain["key"]] = plain
        self._file.write(json.dumps(plain, allow_nan=False).encode() + b"\n")
        self._file.flush()
        os.fsync(self._file.fileno())
        if time.monotonic() - self._written > EVERY_S:
            self.write()

    def write(self) -> None:
        """Write the table, whole or not at all."""
        draft = self.path.with_name(f".{self.path.name}.{os.getpid()}")
        try:
            pyarrow.parquet.write_table(_table(self.whole(), self.what), draft)
            os.replace(draft, self.path)
        except OSError as error:
            draft.unlink(missing_ok=True)
            raise BadInput(str(self.path), f"it cannot be written ({error.strerror})", "name another file") from None
        self._written = time.monotonic()

    def _journalled(self) -> list[Row]:
        """Results that did not get into the table; a line that was cut off by the end of its writer is none."""
        self._file.seek(0)
        whole, _, cut = self._file.read().rpartition(b"\n")
        if cut:
            self._file.truncate(len(whole) + bool(whole))
        rows = [json.loads(line) for line in whole.splitlines()]
        return [row for row in rows if isinstance(row, dict) and "key" in row]


def read_results(path: Path, what: str | None = None) -> list[Row]:
    """The rows of a table of results, of any work or of one kind. Raises BadInput for anything else."""
    try:
        table = pyarrow.parquet.read_table(path)
    except (OSError, pyarrow.ArrowInvalid) as error:
        reason = " ".join(str(error).split())[:120]
        raise BadInput(str(path), f"it is no table of results ({reason})", "name another file") from None
    made = (table.schema.metadata or {}).get(MADE_BY, b"").decode()
    if not made or (what is not None and made != what):
        found = f"it has the results of fleet {made}" if made else "it is not of a fleet"
        raise BadInput(str(path), found, "name another file")
    rows: list[Row] = table.to_pylist()
    return rows


def _table(rows: list[Row], what: str) -> Any:
    found = {name for row in rows for name in row}
    names = [*FIRST, *sorted(found - {*FIRST, *LAST}), *LAST]
    schema = pyarrow.schema([(name, _type(name, rows)) for name in names], metadata={MADE_BY: what.encode()})
    return pyarrow.Table.from_pylist(rows, schema=schema)


def _type(name: str, rows: list[Row]) -> Any:
    """The type of a column: of all values that are there."""
    kinds = {type(row[name]) for row in rows if row.get(name) is not None}
    if kinds == {bool}:
        return pyarrow.bool_()
    if kinds == {int}:
        return pyarrow.int64()
    if kinds and kinds <= {int, float}:
        return pyarrow.float64()
    return pyarrow.string()


def _plain(value: Any) -> Any:
    """A value as JSON and Parquet have it; numbers that are not finite are unknown."""
    if isinstance(value, bool | str) or value is None:
        return value
    if isinstance(value, Mapping | list | tuple):
        return json.dumps(value)
    number = value.item() if hasattr(value, "item") else value
    return number if isinstance(number, bool | int) or math.isfinite(number) else None
