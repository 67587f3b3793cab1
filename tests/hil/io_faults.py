"""The recorder, the monitor and the writer of recordings, again and again, each time with another call failing.

Arguments: a folder, the scenario (`record`, `monitor`, `memory` or `malloc`; `monitor:open,write` tries those calls
only), the stride of the cases, and for `monitor` a model and a healthy recording. Runs with `failing_calls.so`
preloaded. One child process a case, all forked from this one, which has imported and learned everything before. The
last line is JSON: the number of cases, how they ended, and what was promised and not kept.
"""

from __future__ import annotations

import asyncio
import ctypes
import errno
import json
import math
import os
import shutil
import signal
import sys
import traceback
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from hil import (
    LinkEvent,
    Monitor,
    MonitorEvent,
    MonitorSession,
    Reading,
    Recorder,
    RecorderSettings,
    Sample,
    Statistics,
    monitor_session,
)
from recordings import BadInput, BristleError, RecordingWriter, SignalSpec, read, recover

SHIM = ctypes.CDLL(None)  # with failing_calls.so before everything else, else it has none of its functions
KINDS = {"open": 1, "write": 2, "short write": 3, "fsync": 4, "rename": 5, "close": 6, "unlink": 7, "truncate": 8}
CALLS = KINDS | {"malloc": 9}
ERRORS = {"open": errno.EMFILE, "write": errno.ENOSPC, "truncate": errno.ENOSPC, "malloc": errno.ENOMEM}
STEP, N_SAMPLES, BATCH = 0.01, 60, 10
SPECS = (SignalSpec("time", "s", "time"), SignalSpec("position", "mm", "output"), SignalSpec("mode", "1", "extra"))
PATIENCE = 400
"""Turns that a source waits for the disk in all: a refused recording must not hold up the watching."""
LONGEST_S, MOST_WRONG = 60, 20
"""A case that takes longer has hung."""

Report = Callable[[str, Any], None]
"""Tells the parent, at once, what a case has come to."""


class InStep:
    """A source that goes on when the disk has acknowledged the batch before, or does so no more; events in between."""

    def __init__(self, items: list[Sample | LinkEvent], specs: tuple[SignalSpec, ...] = SPECS) -> None:
        self.signals, self.statistics = {"V1": specs}, Statistics()
        self._items, self._given, self.acknowledged = iter(items), 0, 0
        self._patience = PATIENCE

    async def __aenter__(self) -> InStep:
        return self

    async def __aexit__(self, *_: object) -> None:
        pass

    def __aiter__(self) -> InStep:
        return self

    async def __anext__(self) -> Sample | LinkEvent:
        while self._given - self.acknowledged >= BATCH and self._patience:
            self._patience -= 1
            await asyncio.sleep(0.0005)
        item = next(self._items, None)
        if item is None:
            raise StopAsyncIteration
        self._given += isinstance(item, Sample)
        return item


def sample(k: int) -> Sample:
    readings = {"position": Reading(math.sin(k), "mm", time=100.0 + STEP * k), "mode": Reading(float(k % 3), "1")}
    return Sample(100.0 + STEP * k, 1.7e9 + STEP * k, "V1", readings)


def acknowledging(source: InStep, report: Report) -> Callable[[Path, int], None]:
    files: dict[Path, int] = {}

    def acknowledge(path: Path, n_samples: int) -> None:
        report("acknowledged", [str(path), n_samples])
        files[path] = n_samples
        source.acknowledged = sum(files.values())

    return acknowledge


def record(folder: Path, report: Report) -> None:
    """Samples into files that rotate, with an event between them."""
    down = LinkEvent(100.205, 1.7e9, "V1", "bad_value", "mode: not valid: nothing")
    source = InStep([*map(sample, range(20)), down, *map(sample, range(20, N_SAMPLES))])
    settings = RecorderSettings(
        folder, rotate_s=0.25, batch_s=0.001, hold_s=0.1, acknowledge=acknowledging(source, report)
    )
    asyncio.run(Recorder(source, settings).run(asyncio.Event()))  # type: ignore[arg-type]


def write_batches(folder: Path, report: Report, around: Callable[[int], AbstractContextManager[object]]) -> None:
    """The writer alone. around : what is done with a batch of that number."""
    path = folder / "run.h5"
    with RecordingWriter(path, SPECS, chunk_rows=16) as writer:
        for number in range(N_SAMPLES // BATCH):
            rows = np.arange(number * BATCH, (number + 1) * BATCH)
            with around(number):
                writer.append({"time": STEP * rows, "position": np.sin(rows), "mode": rows % 3.0})
            report("acknowledged", [str(path), len(writer)])


def memory(folder: Path, n: int, report: Report) -> None:
    """The n-th allocation of Python's fails in the third batch."""
    import _testcapi

    @contextmanager
    def starving(number: int) -> Iterator[None]:
        if number == 2:
            _testcapi.set_nomemory(n, n + 1)
        try:
            yield
        finally:
            _testcapi.remove_mem_hooks()

    write_batches(folder, report, starving)


def malloc(folder: Path, report: Report) -> None:
    """For allocations of the C library's, which HDF5 and numpy use, wherever they are made."""
    write_batches(folder, report, lambda number: nullcontext())


class Watching:
    """A monitor with a learned detector, whose events, state and recording go to the folder."""

    def __init__(self, model: Path, healthy: Path) -> None:
        from detector import learn_recordings
        from simulator import ValveModel

        recording = read(healthy)
        self._model, self._specs = ValveModel.read(model), recording.header.signals
        self._watch = learn_recordings([recording], self._model, 1.0)
        names = [name for name in recording if name != "time"]
        time = recording.time - recording.time[0]
        self._items: list[Sample | LinkEvent] = []
        for k in range(N_SAMPLES):
            readings = {name: Reading(float(recording[name].values[k]), recording[name].unit) for name in names}
            self._items.append(Sample(float(time[k]), 1.7e9 + float(time[k]), "V1", readings))
            if k % 7 == 3:
                self._items.append(LinkEvent(float(time[k]), 1.7e9, "V1", "bad_value", f"at {k}"))

    def __call__(self, folder: Path, report: Report) -> None:
        source = InStep(self._items, tuple(self._specs))
        monitor = Monitor.with_model(source.signals, self._model, own_clock=True)
        monitor.resume({"V1": (self._watch, None)})
        recorded = RecorderSettings(folder / "runs", batch_s=0.001, acknowledge=acknowledging(source, report))

        def sink(event: MonitorEvent) -> None:
            with open(folder / "events.jsonl", "a", encoding="utf-8") as file:
                print(event.json_line(), file=file)

        session = MonitorSession((sink,), None, folder / "state.json", "m", recorded)
        try:
            end = asyncio.run(monitor_session(source, monitor, session))  # type: ignore[arg-type]
            report("failures", sum(end.failures.values()))
        finally:
            report("watched", monitor.status[0].samples)


# One case


def run_case(work: Callable[[Report], None], folder: Path, arm: Callable[[], None]) -> dict[str, Any]:
    """What one child comes to: what it reports, whether the call was reached, and how it ended."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    inside, outside = os.pipe()
    child = os.fork()
    if child == 0:
        os.close(inside)
        os.dup2(os.open(os.devnull, os.O_WRONLY), 2)
        signal.alarm(LONGEST_S)

        def report(word: str, value: Any) -> None:
            os.write(outside, (json.dumps([word, value]) + "\n").encode())

        try:
            arm()
            work(report)
            ended = ["ended", "well"]
        except BristleError as error:
            ended = ["refused", str(error)]
        except BaseException:
            ended = ["crashed", traceback.format_exc()[-600:]]
        SHIM.failing_calls_disarm()
        report(*ended)
        report("calls", SHIM.failing_calls_count())
        os._exit(0)
    os.close(outside)
    with open(inside) as reports:
        lines = [json.loads(line) for line in reports]
    found: dict[str, Any] = {"acknowledged": {}}
    for word, value in lines:
        if word == "acknowledged":
            found["acknowledged"][value[0]] = value[1]
        else:
            found[word] = value
    _, status = os.waitpid(child, 0)
    if status:
        found["died"] = status
    return found


def lost(found: dict[str, Any]) -> str:
    """What was acknowledged and is not in the files any more, put right where that is needed; empty for nothing."""
    for name, n_samples in found["acknowledged"].items():
        path = Path(name)
        try:
            if path.with_name(path.name + ".journal").exists():
                recover(path)
            made = read(path)
        except BadInput as error:
            return f"{n_samples} samples acknowledged: {error}"
        if len(made) < n_samples:
            return f"{path.name}: {n_samples} acknowledged, {len(made)} there"
        if "mode" in made:
            number = np.rint(made.time / STEP)
            if not np.allclose(made["position"].values, np.sin(number), rtol=0.0, atol=1e-12):
                return f"{path.name}: wrong values"
    return ""


def broken(found: dict[str, Any], folder: Path, crash_allowed: bool = False) -> str:
    """Which promise a case did not keep."""
    if "died" in found and not crash_allowed:
        return f"the process died, status {found['died']}"
    if "crashed" in found and not crash_allowed:
        return found["crashed"]
    words = found.get("refused", "")
    if words and ("\n" in words or str(folder) not in words):
        return f"the words are {words!r}"
    return lost(found)


def unwatched(found: dict[str, Any], folder: Path) -> str:
    """The same of the monitor: it watches every sample, whatever fails, and counts what failed."""
    if problem := broken(found, folder):
        return problem
    if found.get("watched") != N_SAMPLES:
        return f"{found.get('watched')} of {N_SAMPLES} were watched; it was {found.get('refused', 'not refused')}"
    kept = sum(found["acknowledged"].values())
    if kept < N_SAMPLES and not found.get("failures"):
        return f"{N_SAMPLES - kept} samples were not recorded, and no failure is counted"
    return ""


# All cases


def cases(kinds: Iterable[str], stride: int, rare: int) -> Iterator[tuple[str, bool, Iterator[int]]]:
    """(kind, whether it fails for good, which call). rare : the stride of the calls of which there are few."""
    for kind in kinds:
        for for_good in (False, True):
            every = rare if kind in ("open", "rename", "unlink") else stride
            yield kind, for_good, iter(range(1, 1_000_000, every))


def calls_failing(
    work: Callable[[Path, Report], None],
    folder: Path,
    which: Iterable[tuple[str, bool, Iterator[int]]],
    check: Callable[[dict[str, Any]], str],
) -> Iterator[tuple[str, str, str]]:
    for kind, for_good, numbers in which:
        for number in numbers:
            error = ERRORS.get(kind, errno.EIO)
            SHIM.failing_calls_arm.argtypes = [
                ctypes.c_char_p, ctypes.c_int, ctypes.c_long, ctypes.c_int, ctypes.c_int
            ]  # fmt: skip
            arm = partial(SHIM.failing_calls_arm, str(folder).encode(), CALLS[kind], number, error, for_good)
            found = run_case(partial(work, folder), folder, arm)
            if found.get("calls", number) < number:
                break
            yield f"{kind} {number}{' and all later' if for_good else ''}", how(found), check(found)


def how(found: dict[str, Any]) -> str:
    return next(word for word in ("ended", "refused", "crashed", "died") if word in found)


def allocations_failing(folder: Path, stride: int) -> Iterator[tuple[str, str, str]]:
    for number in range(1, 1_000_000, stride):
        found = run_case(partial(memory, folder, number), folder, lambda: None)
        if how(found) == "ended":
            return
        found.pop("refused", None)
        yield f"allocation {number}", how(found) if "crashed" in found else "died", broken(found, folder, True)


def main(folder: Path, scenario: str, stride: int, *more: str) -> None:
    scenario, _, chosen = scenario.partition(":")
    kinds = chosen.split(",") if chosen else KINDS
    if scenario == "memory":
        made = allocations_failing(folder, stride)
    elif scenario == "malloc":  # it may end the process, and take nothing with it
        which = cases(["malloc"], stride, 1)
        made = calls_failing(malloc, folder, which, lambda found: broken(found, folder, crash_allowed=True))
    elif scenario == "record":
        made = calls_failing(record, folder, cases(kinds, stride, 1), lambda found: broken(found, folder))
    else:
        watching = Watching(*map(Path, more))
        which = cases(kinds, stride, 1 + stride // 10)
        made = calls_failing(watching, folder, which, lambda found: unwatched(found, folder))
    ends, wrong, n_cases = Counter[str](), [], 0
    for case, end, problem in made:
        n_cases += 1
        ends[end] += 1
        if problem:
            print(case, problem, file=sys.stderr, flush=True)
            wrong.append([case, problem])
        if len(wrong) >= MOST_WRONG:
            break
    print(json.dumps({"cases": n_cases, "ends": ends, "wrong": wrong}))


if __name__ == "__main__":
    main(Path(sys.argv[1]), sys.argv[2], int(sys.argv[3]), *sys.argv[4:])
