"""`bristle assess` at the console: files, refusals."""

from __future__ import annotations

import json

from identification.loops import simulated_loop


def test_a_file_is_assessed(console, tmp_path):
    loop = simulated_loop(6001, "stiction", "flow", "kano").loop
    rows = [f"{k},{sp},{pv},{op}" for k, (sp, pv, op) in enumerate(zip(loop.sp, loop.pv, loop.op, strict=True))]
    (tmp_path / "loop.csv").write_text("\n".join(["clock,a,b,c", *rows]))
    columns = "SP=a,PV=b,OP=c:%,TIME=clock:s"
    ending = console(
        "assess", tmp_path / "loop.csv", "--loop", "flow", "--columns", columns, "--out", tmp_path / "a.json"
    )
    assert ending.code == 0, ending.err
    assert ending.out.startswith("stiction")
    assert json.loads((tmp_path / "a.json").read_text())["verdict"] == "stiction"
    assert "which column is PV" in console.refused("assess", tmp_path / "loop.csv")
    assert "it is not NAME=COLUMN" in console.refused("assess", tmp_path / "loop.csv", "--columns", "a,b")


def test_a_file_that_is_not_there_is_refused(console, tmp_path):
    assert "no such file" in console.refused("assess", tmp_path / "none.csv")


def test_a_clock_that_runs_backwards_is_refused(console, tmp_path):
    rows = [f"{k % 150},0,{k % 7},{k % 11}" for k in range(300)]
    (tmp_path / "loop.csv").write_text("\n".join(["time,SP,PV,OP", *rows]))
    assert "runs backwards" in console.refused("assess", tmp_path / "loop.csv")
