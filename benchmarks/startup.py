"""Processor time of starting: `import bristle`, its names, and the cheap commands, against an empty program.

python -m benchmarks.startup
"""

from __future__ import annotations

import os
import resource
import statistics
import subprocess
import sys
from pathlib import Path

from benchmarks.machine import machine

HOUSE = Path(__file__).resolve().parents[1]

RUNS = 5
"""Processes of each kind; the median of them counts."""

PROGRAMS = {
    "python -c pass": ("-c", "pass"),
    "import bristle": ("-c", "import bristle"),
    "bristle.Recording": ("-c", "import bristle; bristle.Recording"),
    "bristle.fit": ("-c", "import bristle; bristle.fit"),
    "bristle --version": ("-m", "bristle", "--version"),
    "bristle --help": ("-m", "bristle", "--help"),
    "bristle fit --help": ("-m", "bristle", "fit", "--help"),
}


def processor_ms(*arguments: str, runs: int = RUNS) -> float:
    """Processor time of a Python process [ms], the median of several; one more before fills the caches."""
    times = [_one(arguments) for _ in range(runs + 1)][1:]
    return 1e3 * statistics.median(times)


def _one(arguments: tuple[str, ...]) -> float:
    environment = os.environ | {"PYTHONPATH": str(HOUSE)}
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run([sys.executable, *arguments], check=True, stdout=subprocess.DEVNULL, env=environment)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime


def main() -> None:
    """Print a table."""
    print(machine("numpy", "typer"))
    empty = processor_ms(*PROGRAMS["python -c pass"])
    print(f"\n{'':20} {'processor [ms]':>15} {'above empty [ms]':>17}")
    for name, arguments in PROGRAMS.items():
        spent = processor_ms(*arguments)
        print(f"{name:20} {spent:15.0f} {spent - empty:17.0f}")


if __name__ == "__main__":
    main()
