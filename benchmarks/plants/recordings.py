"""The cases of `benchmarks.trace` as recordings with effects of calibrated strengths, and as files."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from benchmarks.plants.cases import COURSE, Case, Run, runs
from benchmarks.plants.effects import HELD, KNOWN, Valve, fields_of
from benchmarks.plants.strengths import strengths_of
from recordings import Array, Plant, Recording, Signal, write
from simulator import BASE


def recordings(case: Case) -> tuple[list[Recording], list[Recording], dict[str, float]]:
    """The recordings to fit, those to hold out, and the strengths that the effects had."""
    strengths = strengths_of(case)
    made = [_measured(case, shape, run) for shape, run in runs(case, strengths).items()]
    return made[:-1], made[-1:], strengths


def save(case: Case, folder: Path) -> dict[str, float]:
    """Write a case as one file per experiment; what it is stands in /truth alone. Returns the strengths."""
    strengths = strengths_of(case)
    folder.mkdir(parents=True, exist_ok=True)
    valve = Valve.of(case.valve)
    for shape, run in runs(case, strengths).items():
        about: dict[str, float | str | Array] = {
            **valve.values, "effects": " ".join((*BASE, *case.effects)), "form": case.form,
            **{f"strength of {effect}": s for effect, s in strengths.items()},
            **{f"plant.{name}": value for name, value in fields_of(strengths, valve, case.form).items()},
            "position": run.position, "force": run.force,
        }  # fmt: skip
        write(folder / f"{shape}.h5", _measured(case, shape, run), about)
    return strengths


def _measured(case: Case, shape: str, run: Run) -> Recording:
    """What sensors and sampling leave of a run."""
    valve = Valve.of(case.valve)
    rng = np.random.default_rng([case.valve, case.seed, len(shape), 5])
    position = run.reading + rng.normal(0, case.noise * valve.position_noise, len(run.t))
    if "repeated_samples" in case.effects:  # a repeated sample repeats its noise
        fresh = np.r_[True, np.diff(run.reading) != 0]
        position = position[np.maximum.accumulate(np.where(fresh, np.arange(len(fresh)), 0))]
    force = run.force + rng.normal(0, valve.force_noise, len(run.t))
    every = round(COURSE / case.rate)
    if case.slow == "position":
        position = np.where(np.arange(len(position)) % every == 0, position, np.nan)
        every = 1
    drives, answers = ("output", "input") if case.rig else ("input", "output")
    signals = [
        Signal("time", run.t[::every], "s", "time"),
        Signal("force", force[::every], "N", drives, "net force of the actuator on the stem"),
        Signal("position", position[::every], "m", answers, "stem position"),
    ]
    return Recording.of(signals, plant=_plant(case, valve), source="simulated", title=shape)


def _plant(case: Case, valve: Valve) -> Plant:
    """What is known of the plant: its stroke, and what the effect needs to be told from the base."""
    needed = {item for effect in case.effects for item in KNOWN.get(effect, ())}
    return Plant(stroke_m=valve.stroke, **{item: valve.values[HELD[item]] for item in needed})
