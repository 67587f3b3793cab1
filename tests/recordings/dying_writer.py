"""Processes that record until they are killed. Each acknowledged batch is reported as a number of samples.

Arguments: a folder and seeds. For each seed one process is forked, which records into `SEED.h5` of the folder and
reports to the pipe `SEED.acknowledged` beside it; the first word there is its process id. Values follow from the
number of the sample, so that anyone can check them.
"""

from __future__ import annotations

import os
import struct
import sys
from pathlib import Path
from typing import BinaryIO

import numpy as np

from recordings import Event, RecordingWriter, SignalSpec

ROW_S = 0.001


def values(n_samples: int, start: int = 0) -> dict[str, np.ndarray]:
    """What the samples from `start` on are."""
    row = np.arange(start, start + n_samples)
    return {"time": ROW_S * row, "position": np.sin(row), "force": 1.0 * row}


def record(path: Path, seed: int, report: BinaryIO) -> None:
    """Record batches of random length for ever."""
    rng, n_samples = np.random.default_rng(seed), 0
    units = {"time": "s", "position": "m", "force": "N"}
    roles = {"time": "time", "position": "output", "force": "input"}
    specs = [SignalSpec(name, unit, roles[name]) for name, unit in units.items()]  # type: ignore[arg-type]
    hold = 0.1 * (seed % 2)  # every other one leaves samples to the journal for a while
    with RecordingWriter(path, specs, title=f"seed {seed}", chunk_rows=64, hold=hold) as writer:
        while True:
            n_rows = int(rng.integers(1, 30))
            writer.append(values(n_rows, n_samples))
            n_samples += n_rows
            if rng.random() < 0.1:
                writer.event(Event(ROW_S * n_samples, "note", f"at {n_samples}"))
            report.write(struct.pack("<q", n_samples))


def main(folder: Path, seeds: list[int]) -> None:
    """Fork one process a seed and wait for all of them; importing takes longer than dying."""
    for seed in seeds:
        if os.fork() == 0:
            with open(folder / f"{seed}.acknowledged", "wb", buffering=0) as report:
                report.write(struct.pack("<q", os.getpid()))
                record(folder / f"{seed}.h5", seed, report)
    for _ in seeds:
        os.wait()


if __name__ == "__main__":
    main(Path(sys.argv[1]), [int(seed) for seed in sys.argv[2:]])
