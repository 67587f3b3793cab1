"""The demo records its valve: a staircase, sines, and other sines that will judge, over Modbus."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

from bristle.cli.demo.valve import DATA_SHEET, STEP_S, Averaged, controller, moved, ring, served, terminable
from hil import LiveSource, Recorder, RecorderReport, RecorderSettings
from recordings import BadInput

Say = Callable[[str], None]

BLOCK_S, PREPARED_S = 2.0, 5.0
"""Plant time between two looks whether the recorder has everything (the ring holds 5 s), and
before a recording, until the valve is where the recording begins [s]."""

LEVELS = (0.2, 0.35, 0.5, 0.65, 0.8, 0.65, 0.5, 0.35)
PATIENCE_S = 30.0
"""How long the recorder may take for a block [s of the clock]."""


def staircase(t: float) -> float:
    """Set point at plant time t [s]: up and down in steps of two seconds."""
    return LEVELS[int(t / 2.0) % len(LEVELS)]


def sines(t: float) -> float:
    """A slow sine and a quicker one."""
    return 0.5 + 0.25 * math.sin(2 * math.pi * t / 8.0) + 0.1 * math.sin(2 * math.pi * t / 2.16)


def other_sines(t: float) -> float:
    """Two sines of other periods, for the recording that judges."""
    return 0.5 + 0.25 * math.sin(2 * math.pi * t / 9.6 + 1.0) + 0.12 * math.sin(2 * math.pi * t / 2.76)


@dataclass(frozen=True)
class PlannedRecording:
    """A recording to be made: set point over plant time, and how long [s]."""

    setpoint: Callable[[float], float]
    seconds: float

    def later(self, seconds: float) -> PlannedRecording:
        """What is left of it after so many seconds."""
        return PlannedRecording(lambda t: self.setpoint(seconds + t), self.seconds - seconds)


RUNS: Mapping[str, PlannedRecording] = {
    "staircase": PlannedRecording(staircase, 16.0),
    "sines": PlannedRecording(sines, 16.0),
    "held-out": PlannedRecording(other_sines, 28.0),
}
"""The last one judges."""


def record_stage(out: Path, say: Say) -> tuple[Path, ...]:
    """Record the valve; the files, in the order of `RUNS`. Everything that was started has ended when this returns."""
    with terminable():
        return asyncio.run(_stage(out, say))


async def _stage(out: Path, say: Say) -> tuple[Path, ...]:
    async with served() as address, controller(address) as plant:
        say(f"A simulated valve listens on {address}; {', '.join(RUNS)} are recorded from it over Modbus.")
        return tuple([await _recorded(address, plant, run, out / f"{name}.h5") for name, run in RUNS.items()])


async def _recorded(address: str, plant: LiveSource, run: PlannedRecording, path: Path) -> Path:
    """One recording. Raises BadInput when it cannot be written, or the valve does not answer."""
    await moved(plant, lambda _: run.setpoint(0.0), PREPARED_S)
    source, stop = ring(address), asyncio.Event()
    recorder = Recorder(source, RecorderSettings(path, title=f"demo: {path.stem}", plant=DATA_SHEET))
    async with source:
        recording = asyncio.ensure_future(recorder.run(stop))
        try:
            await _taken(source, 1, recording)  # time stands still until the recorder is there
            for block in range(round(run.seconds / BLOCK_S)):
                await moved(plant, run.later(block * BLOCK_S).setpoint, BLOCK_S)
                await _taken(source, (block + 1) * round(BLOCK_S / STEP_S), recording)
        finally:
            stop.set()
            await recording
    return path


async def _taken(source: Averaged, n_samples: int, recording: asyncio.Future[RecorderReport]) -> None:
    """Wait until the recorder has so many samples of the ring. Raises what ended it before, and BadInput."""
    loop = asyncio.get_running_loop()
    end = loop.time() + PATIENCE_S
    while source.taken < n_samples:
        if recording.done():
            await recording
        if recording.done() or loop.time() > end:
            found = f"{source.taken} of {n_samples} samples came in {PATIENCE_S:.0f} s"
            raise BadInput("simulated valve", found, "try again when the machine has less to do")
        await asyncio.sleep(0.005)
