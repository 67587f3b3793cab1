"""`bristle assess` at the console: files, refusals, and the file that it writes."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest

from identification.loops import CAUSES, STROKE, ControlLoop, simulated_loop

PAGE = Path(__file__).parents[2] / "docs" / "files.md"


def as_file(folder: Path, head: str, loop: ControlLoop) -> Path:
    rows = [f"{k},{sp},{pv},{op}" for k, (sp, pv, op) in enumerate(zip(loop.sp, loop.pv, loop.op, strict=True))]
    file = folder / "loop.csv"
    file.write_text("\n".join([head, *rows]))
    return file


def test_a_file_is_assessed(console, tmp_path):
    file = as_file(tmp_path, "clock,a,b,c", simulated_loop(6001, "stiction", "flow", "kano").loop)
    columns = "SP=a,PV=b,OP=c:%,TIME=clock:s"
    ending = console("assess", file, "--loop", "flow", "--columns", columns, "--out", tmp_path / "a.json")
    assert ending.code == 0, ending.err
    assert ending.out.startswith("stiction")
    assert json.loads((tmp_path / "a.json").read_text())["verdict"] == "stiction"
    assert "which column is PV" in console.refused("assess", file)
    assert "it is not NAME=COLUMN" in console.refused("assess", file, "--columns", "a,b")


def documented() -> dict[str, str]:
    """The keys of `assessment.json` on its page, with what is said of them."""
    part = PAGE.read_text().partition("### `assessment.json`")[2].partition("\n### ")[0]
    rows = re.findall(r"^\| (`.*?`) \| (.*) \|$", part, re.MULTILINE)
    return {key.replace("stiction.", "").strip("."): said for keys, said in rows for key in re.findall("`(.*?)`", keys)}


def test_the_page_of_files_has_every_key_and_word_of_the_answer(console, tmp_path):
    known = simulated_loop(6006, "stiction", "flow", "stem")
    file, valve = as_file(tmp_path, "time [s],SP,PV,OP [%]", known.loop), known.stem.values["spring.K"]
    out = tmp_path / "a.json"
    assert console("assess", file, "--loop", "flow", "--valve", f"stroke={STROKE},K={valve}", "--out", out).code == 0
    answer, page = json.loads(out.read_text()), documented()
    assert set(answer) | set(answer["stiction"]) == set(page)
    for key in ("data", "oscillation", "other_causes", "methods"):
        entry = answer[key][0] if isinstance(answer[key], list) else answer[key]
        assert set(entry) == set(entry) & set(re.findall("`(.*?)`", page[key]))
    assert set(answer["stiction"]["S_percent"]) == {"value", "lower", "upper"}
    assert {"correlations", "not_told"} <= set(answer["stiction"]["joint"])
    causes, says = (set(re.findall("`(.*?)`", page[key])) for key in ("other_causes", "methods"))
    assert {one["cause"] for one in answer["other_causes"]} == {*CAUSES} - {"stiction"} <= causes
    assert {one["says"] for one in answer["methods"]} <= says


def test_a_file_that_is_not_there_is_refused(console, tmp_path):
    assert "no such file" in console.refused("assess", tmp_path / "none.csv")


N = 300
T = np.arange(float(N))
GOOD = {"t": T, "sp": np.full(N, 50.0), "pv": 50 + np.sin(T / 5), "op": 50 + 2 * np.cos(T / 5)}


def written(folder: Path, columns: dict[str, object], head: str = "time [s],SP,PV,OP [%]", sign: str = ".") -> Path:
    rows = [",".join(map(str, row)) for row in zip(*columns.values(), strict=True)]
    text = "\n".join([head, *rows])
    file = folder / "loop.csv"
    file.write_text(text if sign == "." else text.replace(",", ";").replace(".", sign))
    return file


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"op": np.full(N, 30.0)}, "OP never changes"),
        ({"pv": GOOD["sp"] + np.sin(T), "sp": GOOD["sp"] + np.sin(T)}, "copy of the set point"),
        ({"t": T % 150}, "runs backwards"),
        ({"t": np.repeat(T[: N // 2], 2)}, "runs backwards or stands still"),
        ({"t": np.cumsum(np.where(T % 2, 1.0, 1.37))}, "sampling is mixed"),
        ({"t": np.cumsum(np.where(T < 150, 1.0, 10.0))}, "sampling is mixed: intervals from 1 s to 10 s"),
        ({"pv": np.full(N, "Bad")}, "no number"),
        ({"pv": np.where(T % 10, "", "50.0")}, "give at least 60"),
    ],
)
def test_what_cannot_be_judged_is_refused_in_one_line(console, tmp_path, changes, said):
    assert said in console.refused("assess", written(tmp_path, GOOD | changes))


@pytest.mark.parametrize(
    ("head", "changes", "said"),
    [
        ("time,SP,PV,OP", {}, "the time has no unit: seconds are taken"),
        ("time [s],SP,PV,OP", {}, "OP has no unit: it is taken as %"),
        ("time [s],SP,PV,OP", {"op": GOOD["op"] * 300}, "the unit of OP is missing and cannot be guessed"),
        ("time [s],SP,PV,OP [mA]", {"op": 4 + 0.16 * GOOD["op"]}, "4 to 20 mA are taken as 0 to 100 %"),
        ("time [s],SP,PV,OP [bar]", {}, "OP is in bar, not in %: S and J are not given"),
        ("time [s],SP,PV,OP [%]", {"t": T + 60 * (T > 99)}, "gaps between samples: 1"),
        ("time [s],SP,PV,OP [%]", {"pv": np.where(T % 2, "", GOOD["pv"])}, "50 % of the samples have no number"),
    ],
)
def test_what_is_missing_or_guessed_is_said(console, tmp_path, head, changes, said):
    ending = console("assess", written(tmp_path, GOOD | changes, head), "--loop", "flow")
    assert ending.code == 0
    assert said in ending.out


def test_a_decimal_comma_is_read(console, tmp_path):
    ending = console("assess", written(tmp_path, GOOD, sign=","), "--loop", "flow")
    assert ending.code == 0
    assert "period 31." in ending.out
