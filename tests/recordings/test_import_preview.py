"""Imports of files as plants write them: local dates, decimal commas, Excel, headers in words, and the preview."""

from __future__ import annotations

import json
import shlex
from datetime import datetime, timedelta
from pathlib import Path

import numpy as np
import openpyxl
import pytest

from bristle.cli.app import run
from recordings import BadInput, read
from recordings.importers import import_file, mapping_of, preview

LOCAL = """Zeitstempel;Travel (%);Actuator pressure (bar);Bemerkung
01.03.2026 08:00:00,000;0,0;0,9;a
01.03.2026 08:00:00,100;1,5;1,0;b
01.03.2026 08:00:00,200;2,5;1,1;c
"""


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    Path("local.csv").write_text(LOCAL)
    return tmp_path


def mapping(**changes: object):
    return mapping_of(changes, "options")


def test_the_preview_says_what_is_there_and_its_command_works(folder, capsys):
    assert run(["import", "local.csv", "--preview", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    becomes = {one["name"]: (one["unit"], one["holds"], one["becomes"]) for one in found["columns"]}
    assert becomes == {
        "Zeitstempel": (None, "dates", "time"),
        "Travel": ("%", "numbers", "position"),
        "Actuator pressure": ("bar", "numbers", "pressure"),
        "Bemerkung": (None, "text", "left out"),
    }
    assert found["missing"] is None
    assert any("say the stroke" in sentence for sentence in found["notes"])
    words = shlex.split(found["command"])
    assert words[:2] == ["bristle", "import"]
    assert run(words[1:]) == 0
    made = read("local.h5")
    np.testing.assert_allclose(made.time, [0.0, 0.1, 0.2])
    np.testing.assert_allclose(made["pressure"].values, [0.9e5, 1.0e5, 1.1e5])
    assert made["position"].unit == "%"


def test_the_preview_in_words_fits_80_columns(folder, capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    assert run(["import", "local.csv", "--preview"]) == 0
    out = capsys.readouterr().out
    assert "Actuator pressure" in out
    assert "to import it, type:" in out
    assert "day-first" in out
    assert max(len(line) for line in out.splitlines() if "─" in line or "pressure" in line) <= 80
    assert not list(folder.glob("*.h5"))


@pytest.mark.parametrize(
    ("text", "form", "seconds"),
    [
        ("01.03.2026 08:00:00,250", None, 0.25),
        ("2026-03-01T08:00:00.250+00:00", None, 0.25),
        ("13/03/2026 08:00:00.250", None, 0.25),
        ("3/13/2026 8:00:00.250 AM", None, 0.25),
        ("01/03/2026 08:00:00.250", "day-first", 0.25),
        ("01-Mar-2026 08:00:00.250", "%d-%b-%Y %H:%M:%S.%f", 0.25),
    ],
)
def test_dates_of_many_countries(tmp_path, text, form, seconds):
    first = text.replace("00,250", "00,000").replace("00.250", "00.000")
    path = tmp_path / "a.csv"
    path.write_text(f"Date;position [mm]\n{first};1.0\n{text};2.0\n")
    time = {} if form is None else {"column": "Date", "format": form}
    np.testing.assert_allclose(import_file(path, mapping(time=time)).recording.time, [0.0, seconds])


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("01/03/2026 08:00:00", "is a date with day or month first; say how dates are written"),
        ("last Tuesday", "is neither a number nor a known date; say how dates are written: iso8601, day-first"),
    ],
)
def test_dates_that_nobody_can_tell_are_asked_for(tmp_path, capsys, text, said):
    path = tmp_path / "a.csv"
    path.write_text(f"Zeit;position [mm]\n{text};1.0\n{text};2.0\n")
    assert run(["import", str(path), "--to", str(tmp_path / "a.h5")]) == 2
    err = capsys.readouterr().err
    assert said in err
    assert "(--time-format)" in err
    assert err.count("\n") == 1


def test_a_format_that_is_none_is_refused():
    with pytest.raises(BadInput, match="'backwards' is no format of dates; allowed: iso8601, day-first, month-first"):
        mapping(time={"column": 1, "format": "backwards"})


def test_excel_is_read_with_its_dates_and_a_title_above(folder):
    book = openpyxl.Workbook()
    sheet = book.active
    sheet.append(["Stem test of 1 March"])
    sheet.append([])
    sheet.append(["Date", "Stem position", "Thrust", "note"])
    sheet.append([None, "mm", "kN", None])
    for k in range(5):
        sheet.append([datetime(2026, 3, 1, 8) + timedelta(seconds=0.5 * k), 1.0 * k, 0.2 * k, "ok"])
    book.create_sheet("other").append(["nothing"])
    book.save("test.xlsx")
    made = import_file("test.xlsx").recording
    np.testing.assert_allclose(made.time, 0.5 * np.arange(5), atol=1e-6)
    np.testing.assert_allclose(made["position"].values, 1e-3 * np.arange(5))
    np.testing.assert_allclose(made["force"].values, 200.0 * np.arange(5))
    with pytest.raises(BadInput, match=r"there is no sheet 'third'; sheets there: Sheet, other"):
        import_file("test.xlsx", mapping(file={"variable": "third"}))


def test_of_several_sheets_the_fullest_is_read_and_named(folder):
    book = openpyxl.Workbook()
    book.active.title = "Protocol"
    book.active.append(["Valve", "FV-101"])
    sheet = book.create_sheet("Test")
    sheet.append(["t_s", "pos_mm", "force_kN"])
    for k in range(50):
        sheet.append([0.1 * k, 10.0 + k, 2.0])
    book.save(folder / "protocol.xlsx")
    made = import_file(folder / "protocol.xlsx")
    assert made.notes[0] == "sheet 'Test' was read, of Protocol, Test"
    assert made.recording["position"].values[-1] == pytest.approx(0.059)
    assert made.recording["force"].values[0] == pytest.approx(2000.0)
    with pytest.raises(BadInput, match="columns: Valve, FV-101"):
        import_file(folder / "protocol.xlsx", mapping(file={"variable": "Protocol"}))


@pytest.mark.parametrize("content", [b"PK\x03\x04 no archive at all", b"PK\x03\x04"])
def test_an_archive_that_is_no_workbook_is_refused(tmp_path, content):
    path = tmp_path / "a.xlsx"
    path.write_bytes(content)
    with pytest.raises(BadInput, match="it is a spreadsheet or an archive"):
        import_file(path)


def test_what_is_hardly_of_a_valve_is_said(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("time [s],travel [mm],actuator pressure [bar]\n0,1.0,90\n1,2.0,91\n")
    notes = " ".join(import_file(path, mapping(plant={"stroke_m": 38.1})).notes)
    assert "pressure reaches 9.1 MPa, which is hardly of a valve" in notes
    assert "stroke_m is 38.1 m, which is hardly of a valve" in notes
    assert "column 'travel' was taken for the position" in notes


def test_two_columns_that_mean_one_signal_are_not_guessed(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("time [s],travel [mm],stem position [mm]\n0,1.0,1.0\n1,2.0,2.0\n")
    assert "position" not in import_file(path).recording.signals


def test_slips_of_the_pen_are_asked_about(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("time [s],Stem position,x\n0,1.0,5\n1,2.0,6\n")
    notes = import_file(path, mapping(signals={"postion": {"column": 2, "unit": "mm"}})).notes
    assert any("did you mean 'position'?" in sentence for sentence in notes)
    with pytest.raises(BadInput, match="did you mean 'Stem position'"):
        import_file(path, mapping(signals={"position": {"column": "Stem positon", "unit": "mm"}}))


def test_every_text_that_is_no_number_is_told_at_once(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("time [s],position [mm],force [N]\n0,Bad,1\n1,No Data,I/O Timeout\n2,1.0,2\n3,2.0,3\n")
    with pytest.raises(BadInput) as refused:
        import_file(path)
    assert all(text in str(refused.value) for text in ("'Bad'", "'No Data'", "'I/O Timeout' in column 'force'"))
    missing = mapping(file={"missing": ["Bad", "No Data", "I/O Timeout"]})
    assert len(import_file(path, missing).recording) == 4


def test_a_file_without_a_clock_is_told_so(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("n,position [mm]\n5,1.0\n3,2.0\n")
    found = preview(path)
    assert found.options == (("rate_hz", "UNIT_HZ"),)
    assert found.missing is not None
