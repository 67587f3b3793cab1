"""Import of CSV, TSV and blank-separated text: many spellings of one table, and one clear line for each fault."""

from __future__ import annotations

import gzip
import resource
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from recording_samples import outcome

from recordings import BadInput, Recording, validate, write
from recordings.importers import ImportMapping, import_file, mapping_of

SIGNALS: dict[str, Any] = {"position": {"column": 2, "unit": "mm"}, "force": {"column": 3, "unit": "kN"}}
BY_NUMBER: dict[str, Any] = {"signals": SIGNALS, "time": {"column": 1, "unit": "ms"}}


def imported(path: Path, content: str | bytes, **mapping: Any) -> Recording:
    """The recording of a file with this content."""
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return import_file(path, mapping_of(mapping, "options")).recording


SPELLINGS: dict[str, tuple[str | bytes, dict[str, Any]]] = {
    "headers with units": ("time [ms],position [mm],force (kN)\n0,1.5,0.2\n10,,0.25\n20,2.5,-0.3\n", {}),
    "headers with suffixes": ("time_ms;position_mm;force_kN\n0;1.5;0.2\n10;;0.25\n20;2.5;-0.3\n", {}),
    "a row of units": ("Time\tPosition\tForce\n[ms]\t[mm]\t[kN]\n0\t1.5\t0.2\n10\tNaN\t0.25\n20\t2.5\t-0.3\n", {}),
    "no header": ("0,1.5,0.2\n10,nan,0.25\n20,2.5,-0.3\n", BY_NUMBER),
    "decimal comma": ("t;x;F\n0;1,5;0,2\n10;;0,25\n20;2,5;-0,3\n", BY_NUMBER | {"file": {"decimal": ","}}),
    "decimal comma and tab": ("0\t1,5\t0,2\n10\t\t0,25\n20\t2,5\t-0,3\n", BY_NUMBER | {"file": {"decimal": ","}}),
    "blanks": ("  0  1.5   0.2\n 10  n/a   0.25 \n 20  2.5  -0.3\n", BY_NUMBER),
    "blanks and decimal comma": ("0 1,5 0,2\n10 - 0,25\n20 2,5 -0,3\n", BY_NUMBER | {"file": {"decimal": ","}}),
    "comments and blank lines": ("# rig 4\n\nt,x,F\n0,1.5,0.2\n# pause\n10,,0.25\n\n20,2.5,-0.3\n", BY_NUMBER),
    "other comments": ("% rig\n0,1.5,0.2\n10,,0.25\n20,2.5,-0.3\n", BY_NUMBER | {"file": {"comment": "%"}}),
    "lines before": (
        "Logger 7\nserial,12\nt,x,F\n0,1.5,0.2\n10,,0.25\n20,2.5,-0.3\n",
        BY_NUMBER | {"file": {"skip_lines": 2}},
    ),
    "spreadsheet hint": ("sep=;\nt;x;F\n0;1.5;0.2\n10;;0.25\n20;2.5;-0.3\n", BY_NUMBER),
    "carriage returns": ("t,x,F\r\n0,1.5,0.2\r\n10,,0.25\r\n20,2.5,-0.3\r\n", BY_NUMBER),
    "byte order mark": (b"\xef\xbb\xbftime [ms],position [mm],force [kN]\n0,1.5,0.2\n10,,0.25\n20,2.5,-0.3\n", {}),
    "latin-1": ("# Über\nt,x,F\n0,1.5,0.2\n10,,0.25\n20,2.5,-0.3\n".encode("latin-1"), BY_NUMBER),
    "utf-16": ("t,x,F\n0,1.5,0.2\n10,,0.25\n20,2.5,-0.3\n".encode("utf-16"), BY_NUMBER),
    "gzip": (gzip.compress(b"t,x,F\n0,1.5,0.2\n10,,0.25\n20,2.5,-0.3\n"), BY_NUMBER),
    "quotes": ('"t","stem, upper","F"\n"0","1.5","0.2"\n"10","","0.25"\n"20","2.5","-0.3"\n', BY_NUMBER),
    "empty last column": ("t,x,F,\n0,1.5,0.2,\n10,,0.25,\n20,2.5,-0.3,\n", BY_NUMBER),
    "unused text": ("t,x,F,note\n0,1.5,0.2,a\n10,,0.25,b\n20,2.5,-0.3,c\n", BY_NUMBER),
    "thousands": ("0;1.5;0.2\n1'0;;0.25\n2'0;2.5;-0.3\n", BY_NUMBER | {"file": {"thousands": "'"}}),
    "odd missing": ("0;1.5;0.2\n10;Bad;0.25\n20;2.5;-0.3\n", BY_NUMBER | {"file": {"missing": ["BAD"]}}),
    "infinite is missing": ("0;1.5;0.2\n10;inf;0.25\n20;2.5;-0.3\n", BY_NUMBER),
    "a separator of its own": ("0|1.5|0.2\n10||0.25\n20|2.5|-0.3\n", BY_NUMBER | {"file": {"separator": "|"}}),
    "no time, a rate": (
        "position [mm],force [kN]\n1.5,0.2\n,0.25\n2.5,-0.3\n",
        {"time": {"rate_hz": 100.0}},
    ),
    "dates": (
        "when,x,F\n2026-11-21 09:30:00.000,1.5,0.2\n2026-11-21 09:30:00.010,,0.25\n2026-11-21 09:30:00.020,2.5,-0.3\n",
        {"signals": SIGNALS, "time": {"column": "when", "unit": "iso8601"}},
    ),
    "named columns": (
        "t,stem pos,thrust\n0,1.5,0.2\n10,,0.25\n20,2.5,-0.3\n",
        {
            "time": {"column": "T", "unit": "ms"},
            "signals": {"position": {"column": "Stem Pos", "unit": "mm"}, "force": {"column": "thrust", "unit": "kN"}},
        },
    ),
    "computed": (
        "t,volt,F\n0,0.75,0.2\n10,,0.25\n20,1.25,-0.3\n",
        BY_NUMBER
        | {
            "signals": {
                "position": {"formula": "2 * volt", "unit": "mm"},
                "force": {"formula": "2*F[kN] - #3[kN] + 0", "unit": "N"},
            }
        },
    ),
    "rows dropped": (
        "t,x,F\n-9,0,0\n-8,0,0\n0,1.5,0.2\n10,,0.25\n20,2.5,-0.3\n",
        BY_NUMBER | {"file": {"drop_rows": 2}},
    ),
    "time sorted": (
        "20,2.5,-0.3\n0,1.5,0.2\n10,,0.25\n10,9,9\n",
        BY_NUMBER | {"time": {"column": 1, "unit": "ms", "repair": "sort"}},
    ),
    "time dropped": (
        "0,1.5,0.2\n10,,0.25\n5,9,9\n,9,9\n10,9,9\n20,2.5,-0.3\n",
        BY_NUMBER | {"time": {"column": 1, "unit": "ms", "repair": "drop"}},
    ),
    "time cut": (
        "-20,9,9\n0,1.5,0.2\n10,,0.25\n20,2.5,-0.3\n30,9,9\n",
        BY_NUMBER | {"time": {"column": 1, "unit": "ms", "from_s": -0.001, "until_s": 0.02}},
    ),
    "turned round": (
        "t,x,F,way\n0,1.5,0.2,up\n20,2.5,-0.3,down\n10,,0.25,down\n",
        BY_NUMBER | {"file": {"reverse": {"column": "way", "value": "down"}}},
    ),
}


@pytest.mark.parametrize("name", SPELLINGS)
def test_one_table_in_many_spellings(tmp_path: Path, name: str) -> None:
    content, mapping = SPELLINGS[name]
    made = imported(tmp_path / "rig.csv", content, **mapping)
    np.testing.assert_allclose(made.time, [0.0, 0.01, 0.02], atol=1e-12)
    np.testing.assert_allclose(made["position"].values, [1.5e-3, np.nan, 2.5e-3])
    np.testing.assert_allclose(made["force"].values, [200.0, 250.0, -300.0])
    assert [made[signal].unit for signal in made] == ["s", "m", "N"]
    assert [made[signal].role for signal in made] == ["time", "output", "input"]
    write(tmp_path / "rig.h5", made)
    assert validate(tmp_path / "rig.h5") == []


def position(column: str | int, unit: str | None = None) -> dict[str, Any]:
    return {"signals": {"position": {"column": column} | ({"unit": unit} if unit else {})}}


def force(formula: str, unit: str = "N") -> dict[str, Any]:
    return {"signals": {"force": {"formula": formula, "unit": unit}}}


def text(**said: Any) -> dict[str, Any]:
    return {"file": said}


GOOD = "t,x,F\n0,1.5,0.2\n10,2,0.25\n20,2.5,-0.3\n"
LONG = "t,x,F\n" + "".join(f"{k},{k},{k}\n" for k in range(1300))
FAULTS: dict[str, tuple[str | bytes, dict[str, Any], str]] = {
    "text in row 1234": (
        LONG.replace("\n1232,1232,", "\n1232,open,"),
        {},
        "rig.csv: row 1234: 'open' in column 'x' is not",
    ),
    "uneven row": (
        LONG.replace("\n1000,1000,1000", "\n1000,1000"),
        {},
        "row 1002: it has 2 cells, the first row has 3; every",
    ),
    "too many cells": (GOOD + "30,1,1,1\n", {}, "rig.csv: row 5: it has 4 cells, the first row has 3"),
    "decimal comma": (
        "t;x;F\n0;1;1\n1;1,5;1\n",
        {},
        "row 3: '1,5' in column 'x' is not a number; the decimal sign is '.'",
    ),
    "decimal point": (
        "t;x;F\n0;1,5;1\n1;1.5;1\n",
        {"file": {"decimal": ","}},
        "row 3: '1.5' in column 'x' is not a number; the",
    ),
    "no number at all": ("t,x,F\n0,,1\n1,,1\n", {}, "rig.csv: signal 'position': its column holds no number; leave"),
    "no such column": (
        GOOD,
        {"signals": {"position": {"column": "stem", "unit": "mm"}}},
        "no column 'stem'; columns there: t, x, F",
    ),
    "no such number": (
        GOOD,
        {"signals": {"position": {"column": 9, "unit": "mm"}}},
        "no column '9'; columns there: t, x, F",
    ),
    "no unit": (
        GOOD,
        {"signals": {"position": {"column": "x"}}},
        "signal 'position': the unit of column 'x' is not known; give it",
    ),
    "unit unknown": (
        GOOD,
        {"signals": {"position": {"column": "x", "unit": "ell"}}},
        "signal 'position': the unit 'ell' is not known",
    ),
    "unit of else": (
        GOOD,
        {"signals": {"position": {"column": "x", "unit": "bar"}}},
        "'bar' cannot be converted to 'm'; allowed",
    ),
    "time without unit": (
        GOOD,
        {"time": {"column": "t"}},
        "column 't': the unit of the time is not known; give it, such as s",
    ),
    "no time": ("x,F\n1,2\n3,4\n", {"time": {}}, "rig.csv: nothing says what the time is; say which column is time"),
    "time stands": (
        GOOD.replace("20,", "10,"),
        {},
        "rig.csv: row 4: time repeats: 0.01 s after 0.01 s; the time of the rows",
    ),
    "time goes back": (
        GOOD.replace("20,", "5,"),
        {},
        "rig.csv: row 4: time goes backwards: 0.005 s after 0.01 s; the time",
    ),
    "time missing": (
        GOOD.replace("10,", ","),
        {},
        "rig.csv: row 3: the time is missing; the time of the rows must increase",
    ),
    "no time left": (
        "t,x,F\n,1,1\n,2,2\n",
        {"time": {"column": 1, "unit": "ms", "repair": "sort"}},
        "rig.csv: 0 rows of data are left; a recording needs at least 2",
    ),
    "time infinite": (GOOD.replace("20,", "inf,"), {}, "rig.csv: row 4: the time is missing"),
    "time cut away": (
        GOOD,
        {"time": {"column": 1, "unit": "ms", "from_s": 9.0}},
        "0 rows lie between the limits of time; time runs",
    ),
    "date no date": (
        "t,x,F\n2026-11-21,1,1\nnoon,2,2\n",
        {"time": {"column": 1, "unit": "iso8601"}},
        "row 3: 'noon' is not a date",
    ),
    "one row": ("t,x,F\n0,1,1\n", {}, "rig.csv: 1 rows of data are left; a recording needs at least 2"),
    "only a header": ("t,x,F\n", {}, "rig.csv: it holds no data"),
    "only comments": ("# a\n# b\n", {}, "rig.csv: it holds no data"),
    "empty": ("", {}, "rig.csv: it is empty (0 bytes)"),
    "binary": (b"\x00\x01\x02" * 100, {}, "rig.csv: it is a binary file of an unknown kind"),
    "spreadsheet": (
        b"PK\x03\x04" + b"x" * 100,
        {},
        "rig.csv: it is a spreadsheet or an archive; save the table as CSV",
    ),
    "cut gzip": (gzip.compress(LONG.encode())[:-20], {}, "rig.csv: the compressed file is damaged"),
    "bad gzip": (b"\x1f\x8b" + b"nonsense" * 9, {}, "rig.csv: the compressed file is damaged"),
    "wrong encoding": (
        GOOD.encode() + b"\xff",
        {"file": {"encoding": "ascii"}},
        "it is not text in ascii; give its encoding",
    ),
    "no such encoding": (GOOD, {"file": {"encoding": "klingon"}}, "it is not text in klingon; give its encoding"),
    "open quote": (
        't,x,F\n0,1,1\n1,"2,2\n' + "3,3,3\n" * 30_000,
        {},
        "rig.csv: it is no table (field larger than field limit",
    ),
    "formula of two columns": (
        GOOD,
        {"signals": {"force": {"formula": "x*F", "unit": "N"}}},
        "two columns are multiplied; a formula",
    ),
    "formula without column": (
        GOOD,
        {"signals": {"force": {"formula": "2*3", "unit": "N"}}},
        "'2*3' has no column; a formula is",
    ),
    "formula of a stranger": (
        GOOD,
        {"signals": {"force": {"formula": "k*F", "unit": "N"}}},
        "there is no column 'k'; columns there",
    ),
    "formula cut short": (
        GOOD,
        {"signals": {"force": {"formula": "2*F -", "unit": "N"}}},
        "'2*F -' ends too early; a formula is a",
    ),
    "formula no formula": (
        GOOD,
        {"signals": {"force": {"formula": "2^F", "unit": "N"}}},
        "'2^F' is not understood from '^F' on",
    ),
    "formula unlike its unit": (
        GOOD,
        {"signals": {"force": {"formula": "x[mm]", "unit": "rpm"}}},
        "cannot be converted to 'N'",
    ),
    "formula of text": (
        GOOD + "30,a,1\n",
        {"signals": {"force": {"formula": "2*x", "unit": "N"}}},
        "row 5: 'a' in column 'x' is",
    ),
    "a column that is a formula": (
        GOOD,
        {"signals": {"force": {"column": "2*F"}}},
        "signal 'force': the unit of '2*F' is not known",
    ),
}


@pytest.mark.parametrize("name", FAULTS)
def test_each_fault_is_one_clear_line(tmp_path: Path, name: str) -> None:
    content, mapping, words = FAULTS[name]
    with pytest.raises(BadInput) as caught:
        imported(tmp_path / "rig.csv", content, **(BY_NUMBER | mapping))
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)


def test_columns_nobody_named_are_carried_or_said_to_be_left_out(tmp_path: Path) -> None:
    path = tmp_path / "rig.csv"
    path.write_text("time [s],position [mm],oil temp [degF],k/m [furlong],count,note\n0,1,212,3,1,a\n1,2,32,4,2,b\n")
    result = import_file(path)
    assert list(result.recording) == ["time", "position", "oil temp", "k_m"]
    assert (result.recording["oil temp"].unit, result.recording["k_m"].unit) == ("degF", "furlong")
    assert result.notes == (
        "columns without numbers were left out: note",
        "columns without a unit were left out: count (to keep them, say which signal each is, and its unit)",
    )
    left = import_file(path, mapping_of({"carry": False, "signals": {"position": {"column": 2}}}, "options"))
    assert (list(left.recording), left.notes) == (["time", "position"], ())


def test_a_table_without_known_signals_says_what_to_do(tmp_path: Path) -> None:
    path = tmp_path / "rig.csv"
    path.write_text("time [s],a,b\n0,1,2\n1,2,3\n")
    with pytest.raises(
        BadInput, match=r"no column is known to be a signal; say which column is the position, .* time, a, b"
    ) as caught:
        import_file(path, ImportMapping())
    assert caught.value.parameters == ("column",)


def test_a_position_in_percent_becomes_metres_with_the_stroke(tmp_path: Path) -> None:
    content = "time [s],position [%],setpoint [%]\n0,50,50\n1,100,100\n"
    about: dict[str, Any] = {"signals": {"position": {"column": "position", "resolution": 0.1}}}
    known = imported(tmp_path / "a.csv", content, plant={"stroke_m": 0.04}, **about)
    assert (known["position"].unit, known["position"].values[0]) == ("m", 0.02)
    assert known["position"].resolution == pytest.approx(4e-5)
    assert (known["setpoint"].unit, known["setpoint"].role) == ("%", "input")
    one_metre = imported(tmp_path / "c.csv", content, plant={"stroke_m": 1.0})
    assert (one_metre["position"].unit, one_metre["position"].values[1]) == ("m", 1.0)
    unknown = imported(tmp_path / "b.csv", content)
    assert (unknown["position"].unit, unknown["position"].values[0]) == ("%", 50.0)


def test_a_wrapping_sensor_is_unwrapped_across_missing_samples(tmp_path: Path) -> None:
    content = "time [s],angle [deg]\n0,350\n1,355\n2,\n3,2\n4,10\n"
    made = imported(tmp_path / "a.csv", content, signals={"angle": {"column": "angle", "period": 360.0}})
    np.testing.assert_allclose(made["angle"].values, [350, 355, np.nan, 362, 370])


def test_where_a_recording_came_from_is_kept(tmp_path: Path) -> None:
    made = imported(tmp_path / "rig.csv", GOOD, title="Rig 4", source="rig", attributes={"run": 3}, **BY_NUMBER)
    assert (made.title, made.source, made.attributes["run"]) == ("Rig 4", "rig", 3)
    assert made.attributes["imported_from"] == "rig.csv"
    assert len(str(made.attributes["imported_sha256"])) == 64
    assert made.created is not None
    dated = imported(
        tmp_path / "d.csv",
        "t,x,F\n2026-11-21T09:30:00+01:00,1,1\n2026-11-21T09:30:01+01:00,2,2\n",
        signals=SIGNALS,
        time={"column": "t", "unit": "iso8601"},
    )
    assert dated.created is not None
    assert dated.created.isoformat() == "2026-11-21T09:30:00+01:00"
    local = imported(
        tmp_path / "l.csv",
        "t;x;F\n01.03.2026 08:00:00,000;1;1\n01.03.2026 08:00:00,500;2;2\n",
        signals=SIGNALS,
        time={"column": "t", "format": "day-first"},
    )
    assert local.created is not None
    assert local.created.isoformat() == "2026-03-01T08:00:00+00:00"


CLOCKS: list[dict[str, Any]] = [
    {"rate_hz": 10.0},
    {"column": 1, "unit": "ms", "repair": "sort"},
    {"column": 2, "unit": "s", "repair": "drop", "from_s": 0.0},
    {"column": 1, "unit": "iso8601"},
]
ANY = st.binary(max_size=300) | st.text("0123456789.,;\t -+eE\n\r\"'#xNa", max_size=300).map(str.encode)
ROWS = st.lists(st.lists(st.floats(), min_size=2, max_size=3).map(lambda row: ";".join(map(str, row))), max_size=9)


@given(ANY | ROWS.map("\n".join).map(str.encode), st.sampled_from(CLOCKS))
@settings(max_examples=200, deadline=None)
def test_any_bytes_make_a_recording_or_bad_input(
    tmp_path_factory: pytest.TempPathFactory, content: bytes, clock: dict[str, Any]
) -> None:
    path = tmp_path_factory.getbasetemp() / "any.csv"
    signals = {"position": {"column": 1, "unit": "mm"}}
    result = outcome(lambda: imported(path, content, time=clock, signals=signals))
    assert "\n" not in str(result)
    assert isinstance(result, BadInput) or len(result) >= 2


@pytest.mark.parametrize("cell", ["1_0", "\u0661\u0662", "x"])
def test_a_cell_that_is_no_number_does_not_take_the_position_away_in_silence(tmp_path, cell):
    path = tmp_path / "rig.csv"
    path.write_text(f"time [s],position [m],force [N]\n0,1,2\n1,{cell},3\n2,3,4\n", encoding="utf-8")
    with pytest.raises(BadInput, match=r"row 3: .* in column 'position' is not a number"):
        import_file(path)


def test_a_line_without_an_end_is_refused_before_it_is_held(tmp_path):
    path = tmp_path / "bomb.csv.gz"
    path.write_bytes(gzip.compress(b"1," * 50_000_000, compresslevel=1))
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    with pytest.raises(BadInput, match="characters or more"):
        import_file(path)
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 60_000
