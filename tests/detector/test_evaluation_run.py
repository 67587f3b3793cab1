"""A whole evaluation in small, its files, and that it goes on where it stopped."""

from __future__ import annotations

import contextlib
import csv
import os
import re
import signal
import subprocess
import sys
import threading
from dataclasses import replace

import pytest

from bristle.cli.app import run
from bristle.cli.evaluating import plan_of
from detector.evaluation import BENCHMARK, detected, evaluate, smoke, tables, write
from simulator.damadics import scenario

WATCHED = ("bank", "limits", "random")
SCENARIOS = ("f18-abrupt-big", "f14-abrupt-big")


@pytest.fixture(scope="module")
def small(tmp_path_factory):
    """Evaluation, folder and what the progress was told."""
    out, reports = tmp_path_factory.mktemp("evaluation"), []
    outcome = evaluate(smoke(WATCHED, SCENARIOS), out, lambda *news: reports.append(news), workers=1)
    return outcome, out, reports


@pytest.mark.slow
def test_what_can_be_seen_is_seen_and_the_rest_is_listed_with_its_ratio(small):
    outcome, _, _ = small
    seen = {name: detected(outcome, "play-1", name, "bank")[0] for name in SCENARIOS}
    assert seen["f18-abrupt-big"] == 1
    assert outcome.detectability["f14-abrupt-big"]["all"] == 0.0
    assert outcome.hours["play-1"] == pytest.approx(1 - 300 / 3600 + 2 * 1200 / 3600 + 2 * 600 / 3600)


@pytest.mark.slow
def test_progress_is_told_for_every_stage(small):
    stages = {label for label, _, _ in small[2]}
    assert {"play: fault-free runs", "play: calibration", "play: scenarios"} <= stages
    assert all(0 <= done <= total for _, done, total in small[2])


@pytest.mark.slow
def test_a_second_run_takes_up_what_is_there_and_gives_the_same(small):
    outcome, out, _ = small
    reports = []
    again = evaluate(smoke(WATCHED, SCENARIOS), out, lambda *news: reports.append(news), workers=1)
    assert again.trials == outcome.trials
    assert not any("calibration" in label for label, _, _ in reports)


@pytest.mark.slow
def test_an_interrupted_run_goes_on(small):
    outcome, out, _ = small
    plan = replace(smoke(WATCHED, (*SCENARIOS, "f2-abrupt-big")))

    def stop(label, done, total):
        if label == "play: scenarios" and done == total:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        evaluate(plan, out, stop, workers=1)
    done = evaluate(plan, out, workers=1)
    assert set(done.trials["play-1"]) == {*SCENARIOS, "f2-abrupt-big"}
    assert done.trials["play-1"]["f18-abrupt-big"] == outcome.trials["play-1"]["f18-abrupt-big"]


@pytest.mark.slow
def test_files_hold_the_tables_and_the_page_needs_no_network(small):
    outcome, out, _ = small
    files = {path.name: path for path in write(outcome, out)}
    with files["trials.csv"].open() as lines:
        rows = list(csv.DictReader(lines))
    assert len(rows) == len(SCENARIOS) * len(WATCHED)
    assert {row["detector"] for row in rows} == set(WATCHED)
    page = files["evaluation.html"].read_text()
    assert "Bokeh" in page
    markup = re.sub(r"<script.*?</script>", "", page, flags=re.DOTALL)
    assert not re.search(r"https?://|<script|<link|<img", markup)
    assert not re.search(r"<script[^>]*src=", page)
    text = files["evaluation.md"].read_text()
    assert "31 of 44 scenarios" in text
    assert "f14-abrupt-big | 0.0000" in text


@pytest.mark.slow
def test_a_run_that_ended_early_is_named_in_words(small):
    outcome = small[0]
    usual = tables(outcome)[1].note
    assert "finite" not in usual
    trial = outcome.trials["play-1"]["f18-abrupt-big"][0] | {"seconds": 1300}
    ended = replace(outcome, trials={"play-1": {"f18-abrupt-big": [trial]}})
    said = tables(ended)[1].note.removeprefix(usual)
    assert said == " f18-abrupt-big in play-1: the simulation stops being finite, judged to 1300 of 1500 s."


@pytest.mark.slow
def test_the_page_draws_every_scenario_and_keeps_its_axes_in_line(small, browser):
    write(small[0], small[1])
    browser.console(), browser.requests()
    browser.open(small[1] / "evaluation.html")
    browser.wait("Bokeh.documents.length == 1 && Bokeh.documents[0].is_idle")
    said = browser.run("return [...document.querySelectorAll('summary')].map(one => one.textContent)")
    assert said[-2:] == [scenario(name).text for name in SCENARIOS]
    assert browser.run("return document.documentElement.scrollWidth <= innerWidth")
    edges = browser.run(
        "return Bokeh.documents[0].roots().flatMap(root => Bokeh.index.get(root).child_views.map("
        "plot => [plot.frame.bbox.left, plot.frame.bbox.right]))"
    )
    assert len(edges) == 2 * len(SCENARIOS)
    assert len({tuple(edge) for edge in edges}) == 1
    assert not [entry for entry in browser.console() if entry.startswith("SEVERE")]
    assert browser.lost_on_a4(small[1] / "evaluation.html") == []
    assert [address for address in browser.requests() if not address.startswith("file:")] == []


@pytest.mark.slow
def test_tables_are_rectangular(small):
    for table in tables(small[0]):
        assert all(len(row) == len(table.heads) for row in table.rows)


def test_published_row_is_31_of_44():
    from detector.evaluation.benchmark.published import R2

    assert len(R2) == len(BENCHMARK)
    assert sum(said == "yes" for said in R2.values()) == 31


def test_command_refuses_in_one_line(capsys, tmp_path):
    assert run(["evaluate", "--out", str(tmp_path), "--detectors", "oracle"]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert "near to it are" in said
    assert run(["evaluate", "--out", str(tmp_path), "--smoke", "--plant", str(tmp_path / "none.mat")]) == 2


@pytest.mark.slow
def test_an_interrupted_command_says_so_in_a_word_and_goes_on(tmp_path, capsys):
    """Two workers, interrupted as soon as something is kept."""
    options = ["--smoke", "--detectors", "limits,random", "--scenarios", "f18-abrupt-big,f18-abrupt-small"]
    command = [sys.executable, "-m", "bristle", "evaluate", *options, "--workers", "2", "--out", str(tmp_path)]
    running = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
    while running.poll() is None and not list(tmp_path.glob("work/*/*.json")):
        with contextlib.suppress(subprocess.TimeoutExpired):
            running.wait(0.05)
    running.send_signal(signal.SIGINT)
    _, said = running.communicate(timeout=60)
    assert (running.returncode, said.splitlines()[-1]) == (130, "bristle: interrupted")
    assert run(command[3:]) == 0
    assert "wrote" in capsys.readouterr().out
    assert (tmp_path / "evaluation.md").exists()
    assert (tmp_path / "evaluation.html").exists()


@pytest.mark.slow
def test_a_killed_command_leaves_no_worker_and_goes_on_where_it_was(tmp_path):
    options = ["--smoke", "--detectors", "limits,random", "--scenarios", "f18-abrupt-big,f18-abrupt-small"]
    command = [sys.executable, "-m", "bristle", "evaluate", *options, "--workers", "2", "--out", str(tmp_path)]
    running = subprocess.Popen(command, stderr=subprocess.DEVNULL, start_new_session=True)
    while running.poll() is None and len(list(tmp_path.glob("work/*/*.json"))) < 2:
        with contextlib.suppress(subprocess.TimeoutExpired):
            running.wait(0.05)
    running.kill()
    running.wait(60)
    for _ in range(600):
        try:
            os.killpg(running.pid, 0)
        except ProcessLookupError:
            break
        threading.Event().wait(0.1)
    else:
        pytest.fail("a worker outlives the command")
    kept = {path: path.stat().st_mtime_ns for path in tmp_path.glob("work/*/*.json")}
    assert len(kept) >= 2
    assert run(command[3:]) == 0
    assert {path: path.stat().st_mtime_ns for path in kept} == kept


def test_a_folder_that_fills_up_is_told_in_one_line(capsys, tmp_path, monkeypatch):
    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("pathlib.Path.replace", full)
    asked = ["evaluate", "--smoke", "--detectors", "limits", "--scenarios", "f18-abrupt-big", "--workers", "1"]
    assert run([*asked, "--out", str(tmp_path)]) == 2
    said = capsys.readouterr().err
    assert "No space left" in said
    assert said.count("\n") == 1


def test_names_given_twice_count_once_and_odd_rates_are_refused(capsys, tmp_path):
    plan = plan_of("limits, random,limits", "f18-abrupt-big,f18-abrupt-big", "all", None, None, True)
    assert (plan.detectors, plan.scenarios, plan.rate_per_h) == (("limits", "random"), ("f18-abrupt-big",), 0.5)
    assert plan_of("all", "all", "all", 2, 0.1, False).long_seeds == 2
    assert len(plan_of("all", "all", "all", None, None, True).scenarios) < 5
    for rate in ("0", "-1", "nan", "11"):
        assert run(["evaluate", "--smoke", "--out", str(tmp_path), "--false-alarms", rate]) == 2
        assert capsys.readouterr().err.count("\n") == 1
