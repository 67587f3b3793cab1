"""Does a change of the code change an answer? Writes down what the commands answer, and compares two such records.

    python tools/compare_behaviour.py record /tmp/before      # in the state before (--python names its interpreter)
    python tools/compare_behaviour.py record /tmp/after       # in the state after
    python tools/compare_behaviour.py compare /tmp/before /tmp/after

Everything goes through the command line, so both states may be built of quite different modules. What is written
down: the models and traces of the bundled recordings, of five seeded sets with noise on position and force, and of one
set whose motion is imposed; the events of a replay; and the tables of a short evaluation. All is compared to the last
digit; exit code 1 tells a difference.
"""

from __future__ import annotations

import argparse
import functools
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import h5py

SEEDS = (11, 12, 13, 14, 15)
"""Seeds of the noisy sets; each is a valve, an excitation and noise of its own."""

RATE_HZ = 250
NOISE = ("--position-noise", "5e-6", "--force-noise", "0.5")
COMPARED = ("*.json", "*.jsonl", "*.csv", "*.txt")
"""Which files are compared: answers, events, tables, and how each command ended. Pages are not."""


class Bristle:
    """The command of one installation, run in a folder; its answers on the terminal are kept beside the files."""

    def __init__(self, python: str, folder: Path) -> None:
        self._python, self.folder = python, folder

    def __call__(self, name: str, *words: str) -> None:
        """Run one command. Raises SystemExit when it ends as bad input or with a defect."""
        command = [self._python, "-m", "bristle", *words]
        done = subprocess.run(command, cwd=self.folder, capture_output=True, text=True, check=False)
        if done.returncode not in (0, 1) or "Traceback" in done.stderr:
            sys.exit(f"{' '.join(command)}: exit code {done.returncode}\n{done.stderr}")
        (self.folder / f"{name}.txt").write_text(f"exit code {done.returncode}\n{done.stdout}", encoding="utf-8")
        print(f"{name}: exit code {done.returncode}", flush=True)


def bundled(bristle: Bristle) -> None:
    """The recordings that come with the package."""
    answers(bristle, "bundled", ["bundled:step", "bundled:sine"], "bundled:mixed")


def imposed(bristle: Bristle) -> None:
    """A recording whose motion is imposed."""
    noisy(bristle, SEEDS[0])
    impose_motion(bristle.folder / f"noisy-{SEEDS[0]}-1.h5", bristle.folder / "imposed.h5")
    answers(bristle, "imposed", ["imposed.h5"], None)


def evaluated(bristle: Bristle) -> None:
    """A short evaluation of three detectors."""
    smoke = ("--smoke", "--workers", "1", "--detectors", "bank,kalman,estimation")
    bristle("evaluate", "evaluate", "--out", "evaluation", *smoke)


def answers(bristle: Bristle, name: str, fitted: Sequence[str], holdout: str | None) -> None:
    """One fit and one trace."""
    judged = ("--holdout", holdout) if holdout else ()
    bristle(f"{name}-fit", "fit", *fitted, *judged, "--out", f"{name}-model.json")
    traced = ("--out", f"{name}-trace.json", "--model-out", f"{name}-traced-model.json")
    bristle(f"{name}-trace", "trace", *fitted, *judged, *traced)


def noisy_set(seed: int, bristle: Bristle) -> None:
    """One seeded set with noise on both channels."""
    answers(bristle, f"noisy-{seed}", *noisy(bristle, seed))


def noisy(bristle: Bristle, seed: int) -> tuple[list[str], str]:
    """Two recordings to fit and one to judge of one valve, with noise on both channels."""
    files = [f"noisy-{seed}-{k}.h5" for k in (1, 2, 3)]
    for file, excitation in zip(files, ("staircase:12,sine:8", "sine:10,step:5", "mixed:12"), strict=True):
        words = ("--to", file, "--excite", excitation, "--rate", f"{RATE_HZ}", "--seed", f"{seed}", *NOISE)
        bristle(f"{file}-simulate", "simulate", *words)
    return files[:2], files[2]


def impose_motion(source: Path, to: Path) -> None:
    """The same signals as a rig would record them that imposes the motion and measures the force."""
    shutil.copyfile(source, to)
    with h5py.File(to, "r+") as file:
        signals = file["signals"]
        for name, role in (("position", "input"), ("force", "output")):
            signals[name].attrs["role"] = role
        for name in set(signals) - {"time", "position", "force"}:
            signals[name].attrs["role"] = "extra"


def watched(bristle: Bristle) -> None:
    """A detector that learns on a recording and then sees another, of which it knows the fault."""
    given = ("--excite", "multisine:60", "--rate", "100", "--seed", "7", *NOISE)
    bristle("healthy-simulate", "simulate", "--to", "healthy.h5", *given)
    bristle(
        "worn-simulate", "simulate", "--to", "worn.h5", *given, "--given", "lugre.fc=140", "--given", "lugre.fs=160"
    )
    bristle("watched-fit", "fit", "healthy.h5", "--out", "watched-model.json")
    known = ("--model", "watched-model.json", "--calibrate", "healthy.h5", "--false-alarms", "300")
    bristle("replay", "replay", "worn.h5", *known, "--events", "events.jsonl")


PARTS: dict[str, Callable[[Bristle], None]] = {
    "bundled": bundled,
    **{f"noisy-{seed}": functools.partial(noisy_set, seed) for seed in SEEDS},
    "imposed": imposed,
    "replay": watched,
    "evaluation": evaluated,
}
"""What is written down, by a name of its own."""


def answer(path: Path) -> bytes:
    """What is compared of a file: all of it, but of what the terminal showed only the line with the exit code, for
    its layout may change.
    """
    content = path.read_bytes()
    return content.partition(b"\n")[0] if path.suffix == ".txt" else content


def differences(one: Path, other: Path) -> Iterator[str]:
    """What differs between two records, a line each."""
    names = {str(path.relative_to(root)) for root in (one, other) for glob in COMPARED for path in root.rglob(glob)}
    for name in sorted(names):
        if not (one / name).exists() or not (other / name).exists():
            yield f"{name}: only in {one if (one / name).exists() else other}"
        elif answer(one / name) != answer(other / name):
            yield f"{name}: differs"
    if not names:
        yield f"nothing to compare in {one} and {other}"


def main() -> int:
    """Entry point: 0 done or all equal, 1 something differs."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    calls = parser.add_subparsers(dest="call", required=True)
    recording = calls.add_parser("record", help="write down what the commands answer")
    recording.add_argument("folder", type=Path)
    recording.add_argument("--python", default=sys.executable, help="the interpreter of the state that is recorded")
    recording.add_argument("--parts", nargs="+", choices=PARTS, default=list(PARTS), help="only these")
    comparing = calls.add_parser("compare", help="compare two records to the last digit")
    comparing.add_argument("one", type=Path)
    comparing.add_argument("other", type=Path)
    asked = parser.parse_args()
    if asked.call == "record":
        asked.folder.mkdir(parents=True)
        bristle = Bristle(asked.python, asked.folder)
        for part in asked.parts:
            PARTS[part](bristle)
        return 0
    found = list(differences(asked.one, asked.other))
    print("\n".join(found) or "no difference")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
