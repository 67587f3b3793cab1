"""Recording takes no more memory the longer it lasts. Hours of samples, as fast as the disk takes them."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

SCRIPT = """
import asyncio, re, sys
from pathlib import Path
from hil import Reading, Recorder, RecorderSettings, Sample, Statistics
from recordings import SignalSpec

NAMES = [f"s{k}" for k in range(13)]
SPECS = (SignalSpec("time", "s", "time"), *(SignalSpec(name, "1", "extra") for name in NAMES))

def held():
    return int(re.search(r"VmRSS:\\s+(\\d+)", Path("/proc/self/status").read_text())[1]) / 1024

class Source:
    signals, statistics = {"V1": SPECS}, Statistics()

    def __init__(self, n):
        self.n, self.k, self.acknowledged, self.seen = n, 0, 0, []

    async def __aenter__(self):
        return self

    async def __aexit__(self, *_):
        pass

    def __aiter__(self):
        return self

    async def __anext__(self):
        while self.k - self.acknowledged >= 1000:
            await asyncio.sleep(0.0002)
        if self.k in (self.n // 5, self.n - 1):
            self.seen.append(held())
        if self.k >= self.n:
            raise StopAsyncIteration
        k, self.k = self.k, self.k + 1
        t = 0.01 * k
        return Sample(t, 1.7e9 + t, "V1", {name: Reading(float(k % 97), "1", time=t) for name in NAMES})

def acknowledge(path, n):
    source.acknowledged = n

source = Source(int(sys.argv[2]))
settings = RecorderSettings(Path(sys.argv[1]) / "run.h5", batch_s=0.001, acknowledge=acknowledge)
asyncio.run(Recorder(source, settings).run(asyncio.Event()))
print(source.seen[1] - source.seen[0])
"""


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="memory is read from /proc")
@pytest.mark.parametrize(
    ("n_samples", "most_megabytes"),
    [
        (30_000, 1.5),
        pytest.param(450_000, 1.0, marks=pytest.mark.long),  # a warm-up of a quarter of an hour, then an hour at 100 Hz
        pytest.param(1_250_000, 5.0, marks=pytest.mark.long),  # the same, then a million rows
    ],
)
def test_memory_does_not_grow_with_the_length_of_a_recording(tmp_path, n_samples, most_megabytes):
    command = [sys.executable, "-c", SCRIPT, str(tmp_path), str(n_samples)]
    grown = float(subprocess.run(command, capture_output=True, text=True, check=True).stdout)
    print(f"{n_samples} rows: {grown:.2f} MB more at the end than after a fifth of them")
    assert grown < most_megabytes
