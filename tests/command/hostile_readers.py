"""Which reader reads each kind of the hostile files, a whole file of each kind, and the damage that is done to it."""

from __future__ import annotations

import hashlib
import io
import json
import sys
from collections.abc import Callable, Mapping
from pathlib import Path

import h5py
import numpy as np
from hostile_files import (
    CSV_HEAD,
    CSV_ROW,
    MODEL,
    PLANT,
    ROWS,
    SERVED,
    STATE,
    SUFFIX,
    TABLE,
    TRACE,
    N,
    mat_of,
    point,
    recording,
)
from hypothesis import strategies as st

from bristle.cli.shown.results import events_words
from bristle.cli.tracing import trace_words
from bristle.door.plant_file import SimulatedPlantFile
from hil import PlantFile, RegisterMap, ServicePlan, load_state
from identification.next_test.rivals import models_of
from recordings import BadInput, Event, Plant, Recording, RecordingWriter, Signal, SignalSpec, read
from recordings.exchange import ABOUT, table_of, write_table
from recordings.importers import import_file, import_to, load_mapping, recover_to
from simulator import ValveModel


def with_mapping(path: Path) -> object:
    """A table whose columns only a mapping could name."""
    table = path.parent / "good table.csv"
    table.write_text(ROWS)
    return import_file(table, load_mapping(path))


def recovered(path: Path) -> object:
    """A recording from its journal alone, which takes its place beside it."""
    target = path.with_name("recovered.h5")
    target.unlink(missing_ok=True)
    return recover_to(path.with_name(path.name.removesuffix(".journal")), target)


def sealed_state(path: Path) -> object:
    """A state file whose checksum is right, whatever it holds: the checksum alone would refuse all damage."""
    try:
        valves = json.loads(path.read_bytes())["valves"]
        checksum = hashlib.sha256(json.dumps(valves, sort_keys=True).encode()).hexdigest()
        path.write_text(json.dumps(STATE | {"valves": valves, "sha256": checksum}))
    except (ValueError, LookupError, TypeError, RecursionError):
        pass
    return load_state(path, "m")


def imported(path: Path) -> object:
    """A file that `bristle export` may have made, as a recording."""
    return import_to(path, path.with_name("imported.h5"), overwrite=True)


def about_a_table(path: Path) -> object:
    """An exported table; what it says of the recording is the file."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    made, columns = path.with_name("exported.parquet"), {"time": np.arange(N) / 100.0, "position": np.sin(np.arange(N))}
    pq.write_table(pa.table(columns).replace_schema_metadata({ABOUT: path.read_bytes()}), made)
    return imported(made)


READERS: Mapping[str, Callable[[Path], object]] = {
    "recording": read,
    "journal": recovered,
    "table": import_file,
    "matlab": import_file,
    "parquet": import_file,
    "hdf5": import_file,
    "spreadsheet": import_file,
    "model": ValveModel.read,
    "trace": trace_words,
    "state": lambda path: load_state(path, "m"),
    "map": RegisterMap.load,
    "csv-map": RegisterMap.load,
    "mapping": with_mapping,
    "plant": lambda path: ServicePlan.of(PlantFile.read(path)),
    "served-plant": SimulatedPlantFile.load,
}
FUZZED = {
    **READERS, "state": sealed_state, "plant": PlantFile.read, "events": events_words, "next-test": models_of,
    "exported-matlab": imported, "exported-about": about_a_table,
}  # fmt: skip


def complaint(reader: Callable[[Path], object], path: Path) -> str:
    """What is wrong with how a file is refused; empty for nothing."""
    try:
        reader(path)
    except BadInput as error:
        words = str(error)
        return "" if "\n" not in words and len(words) < 2000 and str(path.parent) in words else f"said {words[:2000]!r}"
    except Exception as error:  # a defect: it would be a traceback
        return f"raised {error!r:.300}"
    return "it was read"


# Whole files, and their damage


def journal_of(folder: Path) -> bytes:
    """Of a recording that was cut off after two batches."""
    path = folder / "cut.h5"
    specs = [SignalSpec("time", "s", "time"), SignalSpec("position", "m", "output")]
    with RecordingWriter(path, specs, chunk_rows=16) as writer:
        for start in (0, 20):
            rows = np.arange(start, start + 20.0)
            writer.append({"time": rows, "position": np.sin(rows)})
        return path.with_name("cut.h5.journal").read_bytes()


def hdf5_of(folder: Path, whole: bool) -> bytes:
    path = folder / "whole.h5"
    if whole:
        recording(path).close()
    else:
        with h5py.File(path, "w") as file:
            file["time"], file["position"] = np.arange(N) / 100.0, np.sin(np.arange(N))
    return path.read_bytes()


def whole_recording() -> Recording:
    time = Signal("time", np.arange(N) / 100.0, "s", "time")
    signals = [time, Signal("position", np.sin(np.arange(N)), "mm", "output", "stem", 0.01)]
    return Recording.of(signals, title="t", plant=Plant(stroke_m=0.04), events=(Event(0.1, "note", "a"),))


def exported_of(folder: Path) -> bytes:
    write_table(folder / "exported.mat", whole_recording(), "matlab")
    return (folder / "exported.mat").read_bytes()


def parquet_of() -> bytes:
    import pyarrow as pa
    import pyarrow.parquet as pq

    stream = io.BytesIO()
    pq.write_table(pa.table({"time": np.arange(N) / 100.0, "position": np.sin(np.arange(N))}), stream)
    return stream.getvalue()


def sheet_of() -> bytes:
    import openpyxl

    book, stream = openpyxl.Workbook(), io.BytesIO()
    book.active.append(["time [s]", "position [mm]", "force [N]"])
    for k in range(N):
        book.active.append([k / 100, k, 2 * k])
    book.save(stream)
    return stream.getvalue()


def state_of(folder: Path) -> bytes:
    """What a monitor has learned of a healthy valve."""
    sys.path.append(str(Path(__file__).parents[1] / "hil"))
    from monitor_rig import healthy_file, model_file

    from bristle.cli.app import run

    state, model = folder / "learned.json", model_file(folder)
    assert run(["replay", str(healthy_file(folder)), "--model", str(model), "--state", str(state), "--learn", "30"]) < 2
    return json.dumps(json.loads(state.read_text()) | {"model": "m"}).encode()


WHOLE: Mapping[str, Callable[[Path], bytes]] = {
    "recording": lambda folder: hdf5_of(folder, whole=True),
    "journal": journal_of,
    "table": lambda folder: (TABLE + ROWS).encode(),
    "matlab": lambda folder: mat_of(time=np.arange(N) / 100.0, position=np.sin(np.arange(N))),
    "parquet": lambda folder: parquet_of(),
    "hdf5": lambda folder: hdf5_of(folder, whole=False),
    "spreadsheet": lambda folder: sheet_of(),
    "model": lambda folder: json.dumps(MODEL).encode(),
    "trace": lambda folder: json.dumps(TRACE).encode(),
    "state": state_of,
    "map": lambda folder: ('name = "m"\n' + point(scale="0.5", valid_range="[0, 3]", unit='"mm"')).encode(),
    "csv-map": lambda folder: (CSV_HEAD + CSV_ROW).encode(),
    "mapping": lambda folder: b'[time]\ncolumn = 1\nunit = "s"\n[signals.position]\ncolumn = 2\nunit = "mm"\n',
    "plant": lambda folder: PLANT.encode(),
    "served-plant": lambda folder: SERVED.encode(),
    "events": lambda folder: 3 * b'{"time": "2026", "valve": "A", "kind": "alarm", "text": "x"}\n',
    "next-test": lambda folder: json.dumps(TRACE | {"base": MODEL}).encode(),
    "exported-matlab": exported_of,
    "exported-about": lambda folder: table_of(whole_recording()).about.encode(),
}
"""A file of each kind that is read; damage begins with it, and with the files of the corpus."""

SUFFIXES = SUFFIX | {
    "journal": ".h5.journal", "spreadsheet": ".xlsx", "events": ".jsonl", "next-test": ".json",
    "exported-matlab": ".mat", "exported-about": ".json",
}  # fmt: skip

_WORDS = (
    b"", b"\0", b'"', b"'", b"[", b"]", b"{", b"}", b",", b";", b"=", b"\n", b"-", b"1e308", b"1e999", b"nan", b"NaN",
    b"inf", b"Infinity", b"null", b"true", b"9" * 400, b"[" * 3000, b"\xff\xff\xff\xff", b"\xff" * 8, b"\x7f" * 8,
    b"\x80", b"\xc3\x28", b"\xed\xa0\x80", b"\x1b[2J", b"\r", b"../", b"1_0", b"-1", b"0", b"1.5", b"2100-01-01",
)  # fmt: skip

EDITS = st.lists(
    st.tuples(
        st.integers(0, 1 << 17),
        st.one_of(st.integers(0, 8), st.integers(0, 400)),
        st.one_of(st.sampled_from(_WORDS), st.binary(max_size=12)),
    ),
    min_size=1,
    max_size=5,
)
"""(place, bytes that go, bytes that come)."""


def damaged(data: bytes, edits: list[tuple[int, int, bytes]]) -> bytes:
    """A file with some stretches replaced."""
    for place, length, new in edits:
        start = place % (len(data) + 1)
        data = data[:start] + new + data[start + length :]
    return data
