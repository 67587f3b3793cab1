"""A fleet from a folder to a table: every result once, bad recordings, resume, other file systems, the command."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import fsspec
import pytest
from fleet_data import plant, told

import bristle as br
from bristle.cli.app import run
from bristle.fleet.items import fleet_items
from bristle.fleet.results import FleetResults, read_results
from bristle.fleet.run import run_fleet
from recordings import BadInput, bundled, write

STEP = {"kind": "step"}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Six valves and a file that is no recording."""
    return plant(tmp_path_factory.mktemp("fleet") / "plant")


@pytest.fixture(scope="module")
def serial(folder, tmp_path_factory):
    """The results of a serial run."""
    return run_fleet("test", str(folder), tmp_path_factory.mktemp("out") / "r.parquet", options=STEP, workers=0)


def test_every_recording_has_one_row_and_a_bad_one_says_why(serial):
    assert [row["state"] for row in serial] == ["done"] * 6 + ["refused"]
    assert [row["valve"] for row in serial] == [*(f"FV-{101 + k}" for k in range(6)), "FV-999"]
    assert "FV-999.h5" in serial[-1]["sentence"]
    assert all(row["sentence"] for row in serial)


def test_the_table_has_what_the_run_returned(folder, tmp_path):
    out = tmp_path / "r.parquet"
    rows = run_fleet("test", str(folder), out, options=STEP, workers=0)
    there = read_results(out)
    assert {row["key"]: row["state"] for row in there} == {row["key"]: row["state"] for row in rows}
    assert there == rows
    assert not list(tmp_path.glob(".*"))
    assert not list(tmp_path.glob("*.journal"))


def test_what_is_done_is_not_done_again_and_what_changed_is(folder, tmp_path):
    copy = shutil.copytree(folder, tmp_path / "plant")
    out, done = tmp_path / "r.parquet", []

    def go():
        done.clear()
        return run_fleet("test", str(copy), out, options=STEP, workers=0, tell=lambda row: done.append(row["valve"]))

    first = go()
    assert len(done) == 7
    assert told(go()) == told(first)
    assert done == []
    write(copy / "FV-103.h5", bundled("step"))
    (copy / "FV-106.h5").unlink()
    again = go()
    assert done == ["FV-103"]
    assert len(again) == 6


class Stopped(Exception):
    """Somebody ends the program."""


def test_a_run_that_was_stopped_goes_on_where_it_was(folder, tmp_path, serial):
    out, done = tmp_path / "r.parquet", []

    def stop(row):
        done.append(row["key"])
        if len(done) == 3:
            raise Stopped

    with pytest.raises(Stopped):
        run_fleet("test", str(folder), out, options=STEP, workers=0, tell=stop)
    rows = run_fleet("test", str(folder), out, options=STEP, workers=0, tell=lambda row: done.append(row["key"]))
    assert len(done) == len(set(done)) == 7
    assert told(rows) == told(serial)


def test_a_result_outlives_a_killed_process(tmp_path):
    """Results in the journal, the last of them cut off, as SIGKILL leaves them."""
    program = (
        "import os, signal, sys; from pathlib import Path; from bristle.fleet.results import FleetResults\n"
        "row = dict(valve='V', type='', date=None, state='done', sentence='s', page=None, recordings='x.h5', x=0.1)\n"
        "with FleetResults(Path(sys.argv[1]), 'fit') as results:\n"
        "    results._written = float('inf')\n"
        "    for k in range(3): results.add(row | {'key': str(k)})\n"
        '    results._file.write(b\'{"key": "cut\'); results._file.flush()\n'
        "    os.kill(os.getpid(), signal.SIGKILL)\n"
    )
    out = tmp_path / "r.parquet"
    ended = subprocess.run([sys.executable, "-c", program, str(out)], check=False)
    assert ended.returncode == -signal.SIGKILL
    assert not out.exists()
    with FleetResults(out, "fit") as results:
        assert sorted(results.rows) == ["0", "1", "2"]
        assert results.settled("2")
        with pytest.raises(BadInput, match="another fleet is being written"), FleetResults(out, "fit"):
            pass
        results.add(results.rows["0"] | {"key": "3"})
    assert [row["x"] for row in read_results(out)] == [0.1] * 4


def test_recordings_are_taken_from_any_file_system(folder, serial, tmp_path):
    memory = fsspec.filesystem("memory")
    memory.put(str(folder), "/plant", recursive=True)
    try:
        rows = run_fleet("test", "memory://plant", tmp_path / "r.parquet", options=STEP, workers=0)
    finally:
        memory.rm("/plant", recursive=True)
    assert rows[0]["recordings"] == "memory:///plant/FV-101.h5"
    place = {"key", "recordings", "sentence", "seconds", "worker", "worker_memory_MB"}
    ours, theirs = ([{n: v for n, v in row.items() if n not in place} for row in some] for some in (rows, serial))
    assert ours == theirs


def test_a_table_names_valves_types_dates_and_options(folder, tmp_path):
    table = tmp_path / "plant.csv"
    table.write_text(
        f"valve,recordings,type,date,kind\nA,{folder}/FV-101.h5,globe,2025-01-01,\n"
        f"A,{folder}/FV-102.h5,globe,2026-01-01,signature\nB,plant/x.h5,,,\n"
    )
    items = fleet_items(str(table), "test")
    assert [(item.valve, item.kind, item.date, dict(item.own)) for item in items] == [
        ("A", "globe", "2025-01-01", {}), ("A", "globe", "2026-01-01", {"kind": "signature"}), ("B", "", None, {}),
    ]  # fmt: skip
    assert items[2].recordings == (str(tmp_path / "plant" / "x.h5"),)
    rows = run_fleet("test", str(table), tmp_path / "r.parquet", options=STEP, workers=0)
    assert [row["state"] for row in rows] == ["done", "refused", "refused"]
    with pytest.raises(BadInput) as refusal:
        br.test(folder / "FV-102.h5", "signature")
    assert rows[1]["sentence"] == str(refusal.value)


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (
            "valve,files\nA,b.h5\n",
            "plant.csv: it has no column 'recordings'; a table has valve, recordings, type, date",
        ),
        ("valve,recordings\nA,\n", "plant.csv: row 2: recordings: it is empty"),
        ("valve,recordings\n", "plant.csv: there are no recordings in it"),
        (None, "plant.csv: there is no such folder or table"),
    ],
)
def test_a_table_that_cannot_be_used_is_refused_in_words(tmp_path, capsys, content, words):
    table = tmp_path / "plant.csv"
    if content is not None:
        table.write_text(content)
    assert run(["fleet", "fit", str(table), "--out", str(tmp_path / "r.parquet"), "--workers", "0"]) == 2
    assert words in capsys.readouterr().err


def test_the_command_tells_a_sentence_a_valve_and_writes_pages(folder, tmp_path, capsys):
    options = ["--kind", "step", "--workers", "0", "--report", str(tmp_path / "fleet.html")]
    options += ["--pages", str(tmp_path / "valves"), "--out", str(tmp_path / "r.parquet")]
    assert run(["fleet", "test", str(folder), *options]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.partition(":")[0] for line in lines[:-1]] == [*(f"FV-{101 + k}" for k in range(6)), "FV-999"]
    assert lines[-1] == "7 recording sets: 6 done, 1 refused"
    page = (tmp_path / "fleet.html").read_text()
    pages = sorted(path.name for path in (tmp_path / "valves").iterdir())
    assert len(pages) == 6
    assert all(f'href="valves/{name}"' in page for name in pages)


def test_what_cannot_be_done_is_said(folder, tmp_path, capsys):
    out = ["--out", str(tmp_path / "r.parquet"), "--workers", "0"]
    assert run(["fleet", "paint", str(folder), *out]) == 2
    assert "what paint: it cannot be done to a fleet; there are fit, trace" in capsys.readouterr().err
    assert run(["fleet", "test", str(folder), *out]) == 2
    assert "it is not said which test; say one, for example step (--kind)" in capsys.readouterr().err
    (tmp_path / "r.parquet").write_bytes(b"mine")
    assert run(["fleet", "test", str(folder), "--kind", "step", *out]) == 2
    assert "it is no table of results" in capsys.readouterr().err
    assert (tmp_path / "r.parquet").read_bytes() == b"mine"
    assert not (tmp_path / "r.parquet.journal").exists()


@pytest.mark.slow
def test_with_a_killed_worker_every_result_is_there_once_and_is_that_of_a_serial_run(tmp_path):
    """A scheduler and two workers as processes of their own; one worker is killed when the sixth result comes."""
    folder, out, seen = plant(tmp_path / "plant", 12), tmp_path / "r.parquet", []
    file, dask = tmp_path / "scheduler.json", [sys.executable, "-m", "dask"]
    scheduler = [
        *dask,
        "scheduler",
        "--host",
        "127.0.0.1",
        "--port",
        "0",
        "--no-dashboard",
        "--scheduler-file",
        str(file),
    ]
    started = [dask_process(scheduler)]

    def kill(row):
        seen.append(row["key"])
        if len(seen) == 6:
            os.kill(int(row["worker"].rpartition(":")[2]), signal.SIGKILL)

    try:
        found = scheduler_of(file, started[0])
        started += [
            dask_process([*dask, "worker", found, "--nthreads", "1", "--no-nanny", "--no-dashboard"]) for _ in "12"
        ]
        rows = run_fleet("test", str(folder), out, options=STEP, scheduler=found, tell=kill)
        ended = [process.poll() for process in started[1:]]
    finally:
        for process in started:
            process.kill()
            process.wait()
    assert sorted(ended, key=str) == [-signal.SIGKILL, None]
    assert len(seen) == len(set(seen)) == len(rows) == 13
    expected = run_fleet("test", str(folder), tmp_path / "s.parquet", options=STEP, workers=0)
    assert told(rows) == told(expected)


def dask_process(command):
    """A scheduler or a worker as a process of its own."""
    environment = {**os.environ, "PYTHONPATH": str(Path(__file__).resolve().parents[2])}
    return subprocess.Popen(command, env=environment, stderr=subprocess.DEVNULL)


def scheduler_of(file, process):
    """The address in a scheduler's file, once it is there."""
    deadline = time.monotonic() + 600.0
    while not file.exists() or not file.read_text().strip():
        assert process.poll() is None
        assert time.monotonic() < deadline
        time.sleep(0.05)
    return json.loads(file.read_text())["address"]


def test_a_worker_that_goes_costs_no_result(folder, serial, tmp_path):
    """Scheduler and workers in this process; one worker is closed when the second result comes."""
    from distributed import LocalCluster

    seen = []
    with LocalCluster(
        n_workers=2, threads_per_worker=1, processes=False, dashboard_address=None, silence_logs=50, host="127.0.0.1",
        protocol="tcp://",
    ) as cluster:  # fmt: skip

        def close(row):
            seen.append(row["key"])
            if len(seen) == 2:
                cluster.scale(1)

        rows = run_fleet(
            "test", str(folder), tmp_path / "r.parquet", options=STEP, scheduler=cluster.scheduler_address, tell=close
        )
    assert len(seen) == len(set(seen)) == 7
    assert told(rows) == told(serial)


@pytest.mark.slow
def test_the_processes_of_this_machine_give_the_numbers_of_a_serial_run(tmp_path):
    """Fits, on a cluster that the command starts itself."""
    folder = tmp_path / "plant"
    folder.mkdir()
    for seed in range(4):
        made = br.simulate("mixed:10", given={"spring.K": 5e4 + 3e3 * seed}, rate=500, position_noise=2e-6, seed=seed)
        write(folder / f"V{seed}.h5", made)
    ours = run_fleet("fit", str(folder), tmp_path / "r.parquet", workers=2)
    assert [row["state"] for row in ours] == ["done"] * 4
    assert told(ours) == told(run_fleet("fit", str(folder), tmp_path / "s.parquet", workers=0))
