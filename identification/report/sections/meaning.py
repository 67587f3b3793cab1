"""What the numbers mean for a valve: every parameter in one sentence, every effect with what to check on site."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from identification.report.runs import runs
from identification.report.section import Section
from identification.report.wording.key_figures import KeyFigures, key_figures
from identification.report.wording.numbers import number, percent, small_words
from identification.result import FitResult
from simulator import Parameter


@dataclass(frozen=True)
class Facts:
    """What the sentences speak of: parameter values by full name, key figures, the fastest recorded motion [m/s]."""

    p: Mapping[str, float]
    key: KeyFigures
    fastest: float


def meaning(identification: FitResult) -> Section:
    """The section of plain words."""
    model = identification.model
    speeds = [np.nanmax(np.abs(r.trajectory.velocity), initial=0.0) for r in runs(identification)]
    facts = Facts(model.values, key_figures(identification), float(max(speeds)))
    catalogue, effects = identification.fit.kernel.catalogue, []
    for effect in catalogue.pick(tuple(e for e in model.effects if e in catalogue)):
        names = [n for n in effect.parameter_names() if n in model.parameters]
        declared = {effect.parameter_name(p.symbol): p for p in effect.parameters}
        words = [(n, model.parameters[n].status, _sentence(n, declared[n], facts)) for n in names]
        effects.append({"id": effect.id, "sentence": effect.sentence, "check": effect.check, "parameters": words})
    return Section("meaning", "What the numbers mean for a valve", {"effects": effects})


def _sentence(name: str, declared: Parameter, facts: Facts) -> str:
    if name in SENTENCES:
        return SENTENCES[name](facts)
    unit = "" if declared.unit == "1" else f" {declared.unit}"
    return f"{declared.meaning}: {number(facts.p[name])}{unit}."


def _mass(f: Facts) -> str:
    mass = number(f.p["mass.m"])
    return f"{mass} kg move with the stem; it matters only for moves within some tens of milliseconds."


def _spring(f: Facts) -> str:
    if not f.key.rate:
        return "No spring returns the stem: without friction it would drift at the smallest force."
    travel = f"the {f.key.travel_words} of {number(1e3 * f.key.travel)} mm"
    span = number(f.key.span)
    return f"Every millimetre of travel takes {number(f.key.rate / 1e3)} N; over {travel} that is {span} N, the span."


def _preload(f: Facts) -> str:
    preload = number(f.p["spring.F0"])
    if not f.key.rate:
        return f"A constant force of {preload} N acts on the stem: weight, mean flow force or a sensor's offset."
    pressure = f", {number(f.p['spring.F0'] / f.key.area / 1e3)} kPa on the diaphragm" if f.key.area else ""
    full = ""
    if f.key.bench_set:
        full = f"; at full stroke it takes {number(f.key.bench_set[1] / 1e3)} kPa: these two are the bench set"
    return f"At x = 0 the spring already holds {preload} N{pressure}{full}."


def _coulomb(f: Facts) -> str:
    friction, both = number(f.p["lugre.fc"]), number(2 * f.p["lugre.fc"])
    pressure = f" ({number(f.key.swing / 1e3)} kPa)" if f.key.swing else ""
    lost = f", which loses {number(1e3 * f.key.dead_band)} mm of travel" if f.key.dead_band else ""
    return (
        f"A moving stem needs {friction} N against packing and guides; to reverse it, the actuator force must change "
        f"by {both} N{pressure}{lost}."
    )


def _static(f: Facts) -> str:
    fs, fc = f.p["lugre.fs"], f.p["lugre.fc"]
    if fs <= fc:
        return (
            f"Near rest the friction is {number(fs)} N, not above that at speed: this stem creeps, it does not stick."
        )
    more = f", {percent(fs / fc - 1)} more than to keep it moving" if fc > 0 else ""
    jump = f"; once free it jumps by about {number(1e3 * f.key.jump)} mm" if f.key.jump else ""
    return f"It takes {number(fs)} N to break the stem away{more}{jump}."


def _stribeck(f: Facts) -> str:
    speed = number(1e3 * f.p["lugre.vs"])
    return (
        f"Below about {speed} mm/s the friction passes from its level at speed to that at rest: moves slower than this "
        "tend to stick and slip."
    )


def _stiffness(f: Facts) -> str:
    if f.p["lugre.sigma0"] <= 0:
        return "Without bristle stiffness nothing holds the stem at rest."
    give = small_words(f.p.get("lugre.fs", 0.0) / f.p["lugre.sigma0"])
    return (
        f"Before it breaks away the stem gives by {give} and springs back when the force is taken off: moves "
        "smaller than this are elastic."
    )


def _damping(f: Facts) -> str:
    return (
        f"{number(f.p['lugre.sigma1'])} N s/m damp this elastic give; it shows for some milliseconds after a change of "
        "force and hardly matters to a valve."
    )


def _viscous(f: Facts) -> str:
    slope, fastest = f.p["lugre.sigma2"], f.fastest
    return (
        f"Friction grows by {number(slope / 1e3)} N for every mm/s: by {number(slope * fastest)} N at the fastest "
        f"recorded {number(1e3 * fastest)} mm/s."
    )


SENTENCES: Mapping[str, Callable[[Facts], str]] = {
    "mass.m": _mass, "spring.K": _spring, "spring.F0": _preload, "lugre.fc": _coulomb, "lugre.fs": _static,
    "lugre.vs": _stribeck, "lugre.sigma0": _stiffness, "lugre.sigma1": _damping, "lugre.sigma2": _viscous,
}  # fmt: skip
"""Sentences by parameter; a parameter of another effect gets the catalogue's words."""
