"""A corpus of hostile files: damaged, immense when unpacked, nested, of the wrong kind, or saying what cannot be.

``python tests/command/hostile_files.py FOLDER`` writes all of them. Each is refused by its reader with one line.
"""

from __future__ import annotations

import gzip
import io
import json
import struct
import sys
import zlib
from collections.abc import Callable, Iterator
from pathlib import Path
from random import Random

import h5py
import numpy as np

N = 40
SEED = 7

GARBAGE: dict[str, bytes] = {
    "nothing": b"",
    "zeros": bytes(1000),
    "noise": Random(SEED).randbytes(3000),
    "a bracket": b"{",
    "a list": b"[",
    "an end": b"]",
    "half a word": b"nul",
    "not a number": b"NaN",
    "a long number": b"9" * 10_000,
    "a long negative number": b"-" + b"9" * 5000,
    "deep lists": b"[" * 100_000,
    "deep tables": b'{"a":' * 50_000,
    "closed deep lists": b"[" * 5000 + b"]" * 5000,
    "an endless text": b'"' + b"x" * 500_000,
    "half UTF-16": b"\xff\xfex",
    "half UTF-8": b'{"format": "\xc3',
    "a surrogate": b'"\xed\xa0\x80"',
    "true": b"true",
    "a text": b'"valve"',
    "an escape": b"\x1b]0;title\x07\x1b[2J",
    "a page": b"<html><script>alert(1)</script></html>",
    "a pickle": b"\x80\x04\x95\x10\x00\x00\x00\x00\x00\x00\x00\x8c\x05posix\x94\x8c\x06system\x94\x93\x94.",
    "a spreadsheet": b"PK\x03\x04" + bytes(100),
    "keys of a thousand parts": b"a." * 5000 + b"b = 1",
}
LARGE = 80_000_000
"""Bytes of a file of zeros, which takes no room on the disk."""


def corpus(folder: Path, *kinds: str) -> Iterator[tuple[str, Path]]:
    """Write every file, or those of some kinds; (kind of its reader, path)."""
    for kind in kinds or MAKERS:
        make = MAKERS[kind]
        place = folder / kind
        place.mkdir(parents=True, exist_ok=True)
        for number, (name, content) in enumerate(make(place)):
            path = place / f"{number:03d} {name}{SUFFIX[kind]}"
            if isinstance(content, bytes):
                path.write_bytes(content)
            elif isinstance(content, int):
                path.touch()
                with path.open("r+b") as file:
                    file.truncate(content)
            else:
                content(path)
            yield kind, path


Content = bytes | int | Callable[[Path], None]
Named = Iterator[tuple[str, Content]]


def garbage() -> Named:
    yield from GARBAGE.items()
    yield "larger than anything", LARGE


def cut(name: str, data: bytes, n: int) -> Named:
    """The beginning of something, n times."""
    for k in range(n):
        length = max(len(data) * k // n, 1)
        yield f"{name} cut off at {length}", data[:length]


# Recordings


def recording(path: Path) -> h5py.File:
    """A small valid recording, open to be harmed."""
    file = h5py.File(path, "w")
    file.attrs.update({"format": "valve-recording", "version": 1})
    for name, unit, role in (("time", "s", "time"), ("position", "m", "output"), ("force", "N", "input")):
        data = file.create_dataset(f"signals/{name}", data=np.arange(N) / 100.0)
        data.attrs.update({"unit": unit, "role": role})
    return file


def harmed(change: Callable[[h5py.File], object]) -> Callable[[Path], None]:
    def write(path: Path) -> None:
        with recording(path) as file:
            change(file)

    return write


def replaced(name: str, **storage: object) -> Callable[[Path], None]:
    def change(file: h5py.File) -> None:
        about = dict(file[name].attrs)
        del file[name]
        file.create_dataset(name, **storage).attrs.update(about)

    return harmed(change)


def bomb(file: h5py.File, name: str, n_chunks: int, rows: int = 1 << 20) -> None:
    """A dataset of zeros whose every chunk is there, a few KB each."""
    data = file.create_dataset(name, (n_chunks * rows,), "<f8", chunks=(rows,), compression="gzip")
    chunk = zlib.compress(bytes(8 * rows), 9)
    for k in range(n_chunks):
        data.id.write_direct_chunk((k * rows,), chunk)


def bombed(*names: str) -> Callable[[Path], None]:
    def change(file: h5py.File) -> None:
        for name in names:
            about = dict(file[name].attrs)
            del file[name]
            bomb(file, name, 400)
            file[name].attrs.update(about)

    return harmed(change)


def bytes_of(write: Callable[[Path], None], folder: Path) -> bytes:
    write(folder / "scratch")
    data = (folder / "scratch").read_bytes()
    (folder / "scratch").unlink()
    return data


ATTRIBUTES: dict[str, object] = {
    "format": "valve", "version": 99, "title": 3, "source": "nowhere", "created": "yesterday",
}  # fmt: skip
PLANTS: dict[str, object] = {
    "moving_mass_kg": -1.0, "stroke_m": 0.0, "diaphragm_area_m2": np.inf, "spring_constant_N_per_m": np.nan,
    "spring_preload_N": "much", "tag": 3,
}  # fmt: skip


def recordings(folder: Path) -> Named:
    yield from garbage()
    yield from cut("a recording", bytes_of(harmed(lambda file: None), folder), 20)
    for name, value in ATTRIBUTES.items():
        yield f"{name} is {value}", harmed(lambda file, name=name, value=value: file.attrs.update({name: value}))
        yield f"{name} is a table", harmed(lambda file, name=name: file.attrs.update({name: np.zeros((3, 3))}))
    for name, value in PLANTS.items():
        yield (
            f"{name} is {value}",
            harmed(lambda file, name=name, value=value: file.create_group("plant").attrs.update({name: value})),
        )
    for name in ("unit", "role"):
        for value in ("", "furlong\0", 3):
            yield (
                f"{name} is {value!r:.9}".replace("\0", ""),
                harmed(
                    lambda file, name=name, value=value: file["signals/position"].attrs.__setitem__(
                        name, value if isinstance(value, int) else value.replace("\0", "s")
                    )
                ),
            )
        yield f"no {name}", harmed(lambda file, name=name: file["signals/position"].attrs.pop(name))
    for name in ("resolution", "noise_std"):
        for value in (-1.0, np.nan, np.inf, "fine"):
            yield (
                f"{name} is {value}",
                harmed(lambda file, name=name, value=value: file["signals/position"].attrs.update({name: value})),
            )
    for name in ("time", "position"):
        item = f"signals/{name}"
        yield f"{name} declares 2^50", replaced(item, shape=(1 << 50,), dtype="<f8", chunks=(1024,))
        yield f"{name} declares 2^40 bytes", replaced(item, shape=(1 << 40,), dtype="i1", chunks=(1024,))
        yield f"{name} is a table", replaced(item, data=np.zeros((N, 2)))
        yield f"{name} is one number", replaced(item, data=3.0)
        yield f"{name} is text", replaced(item, data=["a"] * N)
        yield f"{name} is complex", replaced(item, data=np.zeros(N, complex))
        yield f"{name} is short", replaced(item, data=np.arange(N - 7.0))
        yield f"{name} has one value", replaced(item, data=[1.0])
        yield f"{name} is empty", replaced(item, data=np.zeros(0))
        yield f"{name} is a bomb", bombed(item)
        yield f"{name} is elsewhere", replaced(item, shape=(N,), dtype="<f8", external=[("/etc/passwd", 0, 8 * N)])
        yield (
            f"{name} is a link",
            harmed(
                lambda file, item=item: (file.pop(item), file.__setitem__(item, h5py.ExternalLink("other.h5", "/a")))
            ),
        )
        yield (
            f"{name} leads nowhere",
            harmed(lambda file, item=item: (file.pop(item), file.__setitem__(item, h5py.SoftLink("/nowhere")))),
        )
        yield f"{name} is a group", harmed(lambda file, item=item: (file.pop(item), file.create_group(item)))
    yield "all signals are bombs", bombed("signals/time", "signals/position", "signals/force")
    yield "time repeats", replaced("signals/time", data=np.zeros(N))
    yield "time goes back", replaced("signals/time", data=-np.arange(N, dtype=float))
    yield "time is missing", replaced("signals/time", data=np.full(N, np.nan))
    yield "time is infinite", replaced("signals/time", data=np.append(np.arange(N - 1.0), np.inf))
    yield "position is missing", replaced("signals/position", data=np.full(N, np.nan))
    yield "two clocks", harmed(lambda file: file["signals/force"].attrs.update({"role": "time", "unit": "s"}))
    yield "no clock", harmed(lambda file: file.pop("signals/time"))
    yield "signals is a number", harmed(lambda file: (file.pop("signals"), file.__setitem__("signals", 3)))
    yield "no signals", harmed(lambda file: file.pop("signals"))
    for name in ("time", "kind", "text"):
        yield f"events without {name}", harmed(lambda file, name=name: (events(file), file.pop(f"events/{name}")))
        yield (
            f"events with short {name}",
            harmed(lambda file, name=name: (events(file), file.pop(f"events/{name}"), events(file, [name], 1))),
        )
    yield "version 2 without its groups", harmed(lambda file: file.attrs.update({"version": 2}))
    yield "version 2 with a wrong code", harmed(lambda file: details(file, 17))
    yield "version 2 with codes in words", harmed(lambda file: details(file, "good"))


def events(file: h5py.File, names: list[str] | None = None, n: int = 3) -> None:
    columns = {"time": np.zeros(n), "kind": ["note"] * n, "text": ["said"] * n}
    for name in names or columns:
        file[f"events/{name}"] = columns[name]


def details(file: h5py.File, code: object) -> None:
    file.attrs["version"] = 2
    for name in ("position", "force"):
        file[f"quality/{name}"] = [code] * N
        file[f"reply_times/{name}"] = np.zeros(N)


# Tables to import

TABLE = "time [s],position [mm],force [N]\n"
ROWS = "".join(f"{k / 100},{k},{2 * k}\n" for k in range(N))
ROW = "0.5,1,2\n"

TABLES: dict[str, str] = {
    "a head alone": TABLE,
    "one row": TABLE + ROW,
    "a row is short": TABLE + ROWS + "0.9,1\n",
    "a row is long": TABLE + ROWS + "0.9,1,2,3\n",
    "time repeats": TABLE + ROW + ROW,
    "time goes back": TABLE + ROWS + "0.0,1,2\n",
    "time is a word": TABLE + ROWS + "noon,1,2\n",
    "time is missing": TABLE + ROWS + ",1,2\n",
    "time is infinite": TABLE + ROWS + "inf,1,2\n",
    "position is a word": TABLE + ROWS + "0.9,open,2\n",
    "all is missing": TABLE + "0,,\n1,,\n2,,\n",
    "position is immense": TABLE + ROWS + "0.9,1e308,2\n",
    "an underscore": TABLE + ROWS + "0.9,1_0,2\n",
    "other digits": TABLE + ROWS + "0.9,\u0661\u0662,2\n",
    "an open quote": TABLE + ROWS + '0.9,"1,2\n' + ROWS,
    "a long cell": TABLE + ROWS + f'0.9,"{"1" * 200_000}",2\n',
    "a long line": TABLE + "1" * (1 << 21),
    "many columns": ",".join(f"c{k}" for k in range(100_000)) + "\n" + ",".join("1" * 100_000) + "\n",
    "names alone": "a,b,c\n" * 20,
    "no unit": "time,position,force\n" + ROWS,
    "unknown unit": "time [s],position [furlong],force [N]\n" + ROWS,
    "time alone": "time [s]\n0\n1\n2\n",
    "no position": "time [s],a,b\n" + ROWS,
    "only commas": ",,,,\n" * 50,
    "only tabs": "\t\t\t\n" * 50,
    "sep and nothing": "sep=;\n",
    "control characters": "time [s]\x1b[2J,position\x07 [mm]\n" + "1,2,3\n" * 3,
    "a formula": "time [s],position [mm],force [N]\n0,=1+1,2\n1,=cmd|x,2\n",
}


def tables(folder: Path) -> Named:
    yield from garbage()
    for name, text in TABLES.items():
        yield name, text.encode()
    packed = gzip.compress((TABLE + ROWS).encode())
    yield from cut("a packed table", packed, 10)
    yield "a packed line", squeezed(b"", b"1" * 100_000, 640, 31)
    rows = "".join(f"{k},0,0\n" for k in range(100)).encode()
    yield "packed rows", squeezed(TABLE.encode() + rows, b"0,0,0\n" * 10_000, 900, 31)
    yield "damaged packing", packed[:40] + bytes([packed[40] ^ 255]) + packed[41:]
    yield "packing in packing", gzip.compress(gzip.compress(packed))
    yield "UTF-16 without an end", ("\ufeff" + TABLE + ROW).encode("utf-16-le")[:-1]


def matlab(variables: bytes) -> bytes:
    return b"MATLAB 5.0 MAT-file".ljust(124) + struct.pack("<H", 0x0100) + b"IM" + variables


def squeezed(start: bytes, chunk: bytes, n: int, form: int = 15) -> bytes:
    """A start and n times the same, packed without ever being held. form : 15 for zlib, 31 for gzip."""
    packing = zlib.compressobj(6, wbits=form)
    parts = [packing.compress(start), *(packing.compress(chunk) for _ in range(n)), packing.flush()]
    return b"".join(parts)


def packed(start: bytes, chunk: bytes = b"", n: int = 0) -> bytes:
    """A packed variable of MATLAB."""
    small = squeezed(start, chunk, n)
    return struct.pack("<II", 15, len(small)) + small


def mat_of(**arrays: np.ndarray) -> bytes:
    from scipy.io import savemat

    stream = io.BytesIO()
    savemat(stream, arrays, do_compression=True)
    return stream.getvalue()


def nested_cells(depth: int) -> bytes:
    """A cell in a cell in a cell."""
    inner = b""
    for _ in range(depth):
        flags = struct.pack("<IIII", 6, 8, 1, 0)
        shape = struct.pack("<IIii", 5, 8, 1, 1)
        name = struct.pack("<II", 1, 0)
        inner = struct.pack("<II", 14, len(flags + shape + name + inner)) + flags + shape + name + inner
    return inner


def matlabs(folder: Path) -> Named:
    yield from garbage()
    whole = mat_of(t=np.arange(N) / 100.0, x=np.sin(np.arange(N)))
    yield from cut("MATLAB", whole, 15)
    yield "a head alone", matlab(b"")
    yield "a bomb", matlab(packed(struct.pack("<II", 14, 1 << 29), bytes(1 << 20), 512))
    yield "declares 4 GB", matlab(struct.pack("<II", 14, 0xFFFFFFF0) + bytes(64))
    yield "deep cells", matlab(nested_cells(3000))
    yield "packed deep cells", matlab(packed(nested_cells(3000)))
    yield "a text alone", mat_of(t=np.array(["words"]))
    yield "a number alone", mat_of(t=np.array(3.0))
    yield "vectors of two lengths", mat_of(time=np.arange(5.0), position=np.arange(7.0))
    yield "complex", mat_of(time=np.arange(5.0) + 1j)


def parquets(folder: Path) -> Named:
    pa = __import__("pyarrow")
    pq = __import__("pyarrow.parquet").parquet

    def of(**columns: object) -> bytes:
        stream = io.BytesIO()
        pq.write_table(pa.table(columns), stream, compression="zstd")
        return stream.getvalue()

    yield "a head alone", b"PAR1"
    yield "head and end", b"PAR1PAR1"
    yield "an immense foot", b"PAR1" + bytes(20) + b"\xff\xff\xff\x7fPAR1"
    whole = of(time=np.arange(N) / 100.0, position=np.sin(np.arange(N)))
    yield from cut("Parquet", whole, 15)
    for place in range(len(whole) - 12, len(whole) - 4):
        yield f"foot flipped at {place}", whole[:place] + bytes([whole[place] ^ 0xFF]) + whole[place + 1 :]
    yield "words alone", of(time=["a"] * N, position=["b"] * N)
    yield "no rows", of(time=np.zeros(0), position=np.zeros(0))
    yield "lists", of(time=[[1.0]] * N)
    yield "many columns", of(**{f"c{k}": np.zeros(2) for k in range(5000)})
    yield "a bomb", of(time=np.zeros(20_000_000, "i1"))


def foreign(folder: Path) -> Named:
    """HDF5 files that are no recordings."""

    def file(change: Callable[[h5py.File], object]) -> Callable[[Path], None]:
        def write(path: Path) -> None:
            with h5py.File(path, "w") as made:
                change(made)

        return write

    yield "nothing in it", file(lambda made: None)
    yield "text in it", file(lambda made: made.__setitem__("a", "words"))
    yield "a bomb", file(lambda made: bomb(made, "time", 400))
    yield "two bombs", file(lambda made: (bomb(made, "time", 200), bomb(made, "position", 200)))
    yield "declares 2^50", file(lambda made: made.create_dataset("time", (1 << 50,), "<f8", chunks=(1024,)))
    yield "a link", file(lambda made: made.__setitem__("time", h5py.ExternalLink("/etc/passwd", "/a")))
    yield "other bytes", file(lambda made: made.create_dataset("a", (9,), "i1", external=[("/etc/passwd", 0, 9)]))
    yield "many", file(lambda made: [made.__setitem__(f"c{k}", [1.0, 2.0]) for k in range(5000)])
    yield from cut("HDF5", bytes_of(file(lambda made: made.__setitem__("time", np.arange(500.0))), folder), 12)


# What is written in words

MODEL = {
    "format": "valve-model", "version": 1, "effects": ["inertia", "spring", "lugre"],
    "parameters": {
        name: {"value": value, "std": 0.1, "unit": unit, "lower": None, "upper": None, "status": "identified"}
        for name, value, unit in (
            ("mass.m", 2.0, "kg"), ("spring.K", 1e5, "N/m"), ("spring.F0", 2e3, "N"), ("lugre.fc", 100.0, "N"),
            ("lugre.fs", 150.0, "N"), ("lugre.vs", 1e-3, "m/s"), ("lugre.sigma0", 1e6, "N/m"),
            ("lugre.sigma1", 1e3, "N s/m"), ("lugre.sigma2", 1e3, "N s/m"),
        )
    },
    "plant": {"stroke_m": 0.04},
}  # fmt: skip

WRONG_IN_MODEL: dict[str, tuple[tuple[str, ...], object]] = {
    "format": (("format",), "valve"), "version": (("version",), 99), "version in words": (("version",), "one"),
    "effects is a number": (("effects",), 3), "unknown effect": (("effects",), ["magic"]),
    "effects are lists": (("effects",), [["inertia"]]), "parameters are a list": (("parameters",), [1]),
    "no parameters": (("parameters",), {}), "a value is a word": (("parameters", "mass.m", "value"), "heavy"),
    "a value is a list": (("parameters", "mass.m", "value"), [1]),
    "no value": (("parameters", "mass.m", "value"), None),
    "a value is infinite": (("parameters", "mass.m", "value"), float("inf")),
    "a value is none": (("parameters", "mass.m", "value"), float("nan")),
    "a value is beyond all": (("parameters", "mass.m", "value"), 10**400),
    "a negative mass": (("parameters", "mass.m", "value"), -2.0),
    "a negative deviation": (("parameters", "mass.m", "std"), -1.0),
    "bounds the wrong way round": (
        ("parameters", "mass.m"),
        {"value": 2.0, "std": 0.1, "unit": "kg", "lower": 3.0, "upper": 1.0, "status": "identified"},
    ),
    "an unknown status": (("parameters", "mass.m", "status"), "guessed"),
    "a unit is a number": (("parameters", "mass.m", "unit"), 3),
    "a plant in words": (("plant", "stroke_m"), "long"), "a plant is a list": (("plant",), [1]),
    "a stroke is a list": (("plant", "stroke_m"), [1]),
}  # fmt: skip


def changed(content: object, place: tuple[str, ...], value: object) -> object:
    if not place:
        return value
    assert isinstance(content, dict)
    return content | {place[0]: changed(content.get(place[0], {}), place[1:], value)}


def models(folder: Path) -> Named:
    yield from garbage()
    for name, (place, value) in WRONG_IN_MODEL.items():
        yield name, json.dumps(changed(MODEL, place, value)).encode()
    yield from cut("a model", json.dumps(MODEL).encode(), 12)


TRACE = {
    "format": "valve-trace", "version": 1, "verdict": "none", "effects_added": [], "unlisted": None,
    "error": {"before": {"fit": {"rmse_m": 1e-5}}, "after": {"fit": {"rmse_m": 1e-5}}}, "candidates": [],
}  # fmt: skip


def traces(folder: Path) -> Named:
    yield from garbage()
    for name in ("verdict", "effects_added", "error", "candidates", "unlisted"):
        yield f"no {name}", json.dumps({key: value for key, value in TRACE.items() if key != name}).encode()
    for name, value in {"error": 3, "candidates": [3], "effects_added": [[3]], "unlisted": 3}.items():
        yield f"{name} is {value}", json.dumps(TRACE | {name: value}).encode()
    beyond = changed(TRACE, ("error", "before", "fit", "rmse_m"), 10**400)
    yield "an error beyond all", json.dumps(beyond).encode()
    yield "an error in words", json.dumps(changed(TRACE, ("error", "before", "fit", "rmse_m"), "small")).encode()
    yield from cut("a trace", json.dumps(TRACE).encode(), 10)


STATE = {"format": "monitor-state", "version": 3, "model": "m", "sha256": "0" * 64, "valves": {}}


def states(folder: Path) -> Named:
    yield from garbage()
    for name, value in {
        "format": 3, "version": 1, "model": "another", "valves": [], "sha256": None,
    }.items():  # fmt: skip
        yield f"{name} is {value}", json.dumps(STATE | {name: value}).encode()
    yield "a wrong checksum", json.dumps(STATE).encode()
    yield from cut("a state", json.dumps(STATE).encode(), 10)


POINT = {"name": '"a"', "table": '"input"', "address": "1", "type": '"uint16"'}
WRONG_IN_POINT: dict[str, tuple[str, ...]] = {
    "name": ('""', "5", "[]", '"a\\u0000b"'),
    "table": ('"inputs"', "3", "[]"),
    "address": ("-1", "65536", "1.5", '"one"', "true", "[1]", "1e300", "9" * 30, "inf"),
    "type": ('"int7"', "3", "[]", '"float128"'),
    "byte_order": ('"AABB"', "7", '"abcd"'),
    "scale": ('"a"', "inf", "nan", "[]", "0"),
    "offset": ('"a"', "inf", "nan", "[]"),
    "unit": ("5", "[]"),
    "valid_range": ("[1]", "[2, 1]", '["a", "b"]', "5", "[1, 2, 3]"),
    "invalid": ('["x"]', "[inf]", "[1.5]"),
    "bit": ("16", "-1", '"a"', "true"),
    "unit_id": ("-1", "256", '"a"'),
    "adress": ("3",),
}
WRONG_MAPS: dict[str, str] = {
    "no points": 'name = "m"',
    "points are none": 'name = "m"\npoints = []',
    "points are a number": 'name = "m"\npoints = 5',
    "points are words": 'name = "m"\npoints = ["a"]',
    "unknown heartbeat": 'heartbeat = "b"',
    "max_read is 0": "max_read = 0",
    "max_read is large": "max_read = 126",
    "max_read is a word": 'max_read = "many"',
    "max_hole is negative": "max_hole = -1",
    "unknown kind": 'kind = "both"',
    "kind is a list": "kind = [1]",
    "a ring of nothing": "ring = 3",
    "unknown key": "speed = 9",
    "twice a key": 'name = "m"\nname = "n"',
}


def point(**changes: str) -> str:
    return "[[points]]\n" + "".join(f"{key} = {value}\n" for key, value in (POINT | changes).items())


def maps(folder: Path) -> Named:
    yield from garbage()
    for key, values in WRONG_IN_POINT.items():
        for k, value in enumerate(values):
            yield f"{key} wrong {k}", f'name = "m"\n{point(**{key: value})}'.encode()
    for name, text in WRONG_MAPS.items():
        head = "" if text.startswith('name = "m"\np') else 'name = "m"\n'
        body = "" if "points" in name else point()
        yield name, f"{head}{text}\n{body}".encode()
    yield "two of one name", ('name = "m"\n' + point() + point(address="9")).encode()
    yield "two in one place", ('name = "m"\n' + point() + point(name='"b"')).encode()
    yield "many points", ('name = "m"\n' + "".join(point(name=f'"p{k}"', address=str(k)) for k in range(5000))).encode()


CSV_HEAD, CSV_ROW = "name,table,address,type\n", "a,input,1,uint16\n"
WRONG_CSV: dict[str, str] = {
    "no rows": CSV_HEAD,
    "unknown column": "name,table,adress,type\n" + CSV_ROW,
    "twice a column": "name,table,address,address\na,input,1,2\n",
    "a row is long": CSV_HEAD + "a,input,1,uint16,5,6\n",
    "a row is short": CSV_HEAD + "a,input\n",
    "an open quote": 'name,"table,address,type\n' + CSV_ROW,
    "an address in words": CSV_HEAD + "a,input,one,uint16\n",
    "an underscore": CSV_HEAD + "a,input,1_0,uint16\n",
    "other digits": CSV_HEAD + "a,input,\u0661,uint16\n",
    "an address beyond": CSV_HEAD + "a,input,70000,uint16\n",
    "a long number": CSV_HEAD + f"a,input,{'9' * 5000},uint16\n",
    "a long cell": CSV_HEAD + f"{'a' * 200_000},input,1,uint16\n",
    "an unknown type": CSV_HEAD + "a,input,1,int7\n",
    "an unknown table": CSV_HEAD + "a,inputs,1,uint16\n",
    "many rows": CSV_HEAD + "".join(f"p{k},input,{k},uint16\n" for k in range(5000)),
    "twice a name": CSV_HEAD + CSV_ROW + CSV_ROW,
}


def csv_maps(folder: Path) -> Named:
    yield from garbage()
    for name, text in WRONG_CSV.items():
        yield name, text.encode()


WRONG_MAPPINGS: dict[str, str] = {
    "unknown section": "[tim]\ncolumn = 1",
    "time is a number": "time = 3",
    "no such column": '[time]\ncolumn = "t9"\nunit = "s"',
    "unknown unit": '[time]\ncolumn = 1\nunit = "fortnight"',
    "a negative rate": "[time]\nrate_hz = -1",
    "an infinite rate": "[time]\nrate_hz = inf",
    "unknown repair": '[time]\ncolumn = 1\nrepair = "magic"',
    "signals are a list": "signals = [1]",
    "a signal is a number": "[signals]\nposition = 3",
    "a signal of nothing": "[signals.position]\nunit = 'mm'",
    "a formula that runs": '[signals.position]\ncolumn = "__import__(1)"\nunit = "mm"',
    "negative lines": "[file]\nskip_lines = -1",
    "an encoding": '[file]\nencoding = "klingon"',
    "a negative mass": "[plant]\nmoving_mass_kg = -1",
    "an unknown plant": "[plant]\ncolour = 1",
    "a source": 'source = "nowhere"',
}


def mappings(folder: Path) -> Named:
    yield from garbage()
    for name, text in WRONG_MAPPINGS.items():
        yield name, text.encode()


SERVICE_PLANT = """
name = "Unit 7"
[[source]]
address = "tcp://127.0.0.1:1"
[[source.valve]]
tag = "LC74_20"
map = "damadics"
model = "model.json"
"""
REACHING_PLANTS = {
    "a program": SERVICE_PLANT + '[events]\nprogram = "touch run"\n',
    "a program with its option": 'on_event = "touch run"\n' + SERVICE_PLANT,
    "a tag that leaves the folder": SERVICE_PLANT.replace("LC74_20", "../../outside"),
    "a tag with a line break": SERVICE_PLANT.replace("LC74_20", "LC\\n74"),
    "a tag for a shell": SERVICE_PLANT.replace("LC74_20", "$(touch run)"),
    "a model that is a device": SERVICE_PLANT.replace("model.json", "/dev/zero"),
    "a model in a pipe": SERVICE_PLANT.replace("model.json", "/dev/fd/0"),
    "a source that is code": SERVICE_PLANT.replace("tcp://127.0.0.1:1", "__import__('os').system('touch run')"),
    "a source that is a page": SERVICE_PLANT.replace("tcp://127.0.0.1:1", "http://127.0.0.1/rig.h5"),
    "a recording that is a device": SERVICE_PLANT.replace("tcp://127.0.0.1:1", "replay:/dev/zero"),
    "a map that is a device": SERVICE_PLANT.replace("damadics", "/dev/zero"),
    "rates without end": SERVICE_PLANT.replace("[[source.valve]]", "rate_hz = inf\n[[source.valve]]"),
    "a rate of a thousand million": SERVICE_PLANT.replace("[[source.valve]]", "rate_hz = 1e9\n[[source.valve]]"),
    "metrics for all": SERVICE_PLANT + '[metrics]\nlisten = "0.0.0.0:9108\\r\\nX: y"\n',
    "valves without end": SERVICE_PLANT + '[[source.valve]]\ntag = "V"\nmodel = "model.json"\n' * 600,
    "nested": "x = " + "[" * 100_000,
    "a number of ten thousand digits": "x = " + "9" * 10_000,
    "a million keys": "".join(f"k{k} = 1\n" for k in range(100_000)),
}
PLANT = """name = "Unit 7"
figures_every_s = 60.0

[[source]]
address = "tcp://127.0.0.1:1"
rate_hz = 10.0

[[source.valve]]
tag = "V1"
model = "model.json"
map = "damadics"
unit = 1
"""
WRONG_PLANTS: dict[str, str] = {
    "no name": PLANT.replace("name =", "nam ="),
    "no source": 'name = "a"\n',
    "source is a number": 'name = "a"\nsource = 3\n',
    "no valve": PLANT[: PLANT.index("[[source.valve]]")],
    "an unknown key": PLANT + "speed = 3\n",
    "a unit beyond": PLANT.replace("unit = 1", "unit = 248"),
    "a unit of 5000 digits": PLANT.replace("unit = 1", "unit = " + "9" * 5000),
    "a rate of nothing": PLANT.replace("rate_hz = 10.0", "rate_hz = 0"),
    "an infinite rate": PLANT.replace("rate_hz = 10.0", "rate_hz = inf"),
    "a rate that is no number": PLANT.replace("rate_hz = 10.0", "rate_hz = nan"),
    "a tag that leaves the folder": PLANT.replace('"V1"', '"../../etc"'),
    "a tag with an escape": PLANT.replace('"V1"', '"V\\u001b[2J"'),
    "twice a tag": PLANT + PLANT[PLANT.index("[[source.valve]]") :],
    "a long tag": PLANT.replace('"V1"', f'"{"V" * 300}"'),
    "a thousand valves": PLANT
    + "".join(PLANT[PLANT.index("[[source.valve]]") :].replace("V1", f"W{k}") for k in range(1000)),
    "figures too often": PLANT.replace("60.0", "1e-9"),
    "a page without a guard": PLANT + '[page]\nexpose = true\nlisten = "0.0.0.0:80"\n',
    "a port beyond": PLANT + '[metrics]\nlisten = "127.0.0.1:123456"\n',
    "a topic of all": PLANT + '[events.mqtt]\nhost = "a"\ntopic = "#"\n',
    "a program": PLANT + '[events]\nrun = "sh"\n',
}


def plants(folder: Path) -> Named:
    """Plant files that reach out, run something, or have no end."""
    yield from garbage()
    for name, text in (WRONG_PLANTS | REACHING_PLANTS).items():
        yield name, text.encode()


SERVED = """friction = "lugre"
noise = true

[set]
setpoint = 0.3

[[fault]]
number = 4
strength = 0.5
from = 70
"""
WRONG_SERVED: dict[str, str] = {
    "an unknown key": "speed = 3\n" + SERVED,
    "set is a number": "set = 3\n",
    "set is infinite": SERVED.replace("0.3", "inf"),
    "set is beyond all": SERVED.replace("0.3", "1" + "0" * 5000),
    "set is a word": SERVED.replace("0.3", '"much"'),
    "a fault in words": SERVED.replace("number = 4", 'number = "four"'),
    "a fault of no number": SERVED.replace("number = 4\n", ""),
    "a strength that is no number": SERVED.replace("strength = 0.5", "strength = nan"),
    "a direction": SERVED + "direction = 2\n",
    "a negative seed": "seed = -1\n",
    "faults are a number": "fault = 3\n",
    "effects are lists": "effect = [1]\n",
    "effects of lists": "[effect]\nbacklash = [1]\n",
    "noise is a list": "noise = [1]\n",
}


def served_plants(folder: Path) -> Named:
    for name, content in garbage():
        if name != "nothing":  # everything has a default
            yield name, content
    for name, text in WRONG_SERVED.items():
        yield name, text.encode()


MAKERS: dict[str, Callable[[Path], Named]] = {
    "recording": recordings, "table": tables, "matlab": matlabs, "parquet": parquets, "hdf5": foreign, "model": models,
    "trace": traces, "state": states, "map": maps, "csv-map": csv_maps, "mapping": mappings, "plant": plants,
    "served-plant": served_plants,
}  # fmt: skip
SUFFIX = {
    "recording": ".h5", "table": ".csv", "matlab": ".mat", "parquet": ".parquet", "hdf5": ".h5", "model": ".json",
    "trace": ".json", "state": ".json", "map": ".toml", "csv-map": ".csv", "mapping": ".toml", "plant": ".toml",
    "served-plant": ".toml",
}  # fmt: skip


if __name__ == "__main__":
    print(f"{sum(1 for _ in corpus(Path(sys.argv[1])))} files in {sys.argv[1]}")
