"""What the numbers mean for a valve: every parameter in one sentence, every effect with what to check on site."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from identification._result import Identification
from identification.report._key_figures import KeyFigures, key_figures
from identification.report._numbers import number, percent
from identification.report._parameters import meaning as in_the_catalogue
from identification.report._runs import runs
from identification.report._section import Section
from simulator import CATALOGUE

Values = dict[str, float]


def meaning(identification: Identification) -> Section:
    """The section of plain words."""
    figures, values = key_figures(identification), identification.model.values
    effects = []
    for effect in CATALOGUE.pick(tuple(e for e in identification.model.effects if e in CATALOGUE)):
        names = [n for n in effect.parameter_names() if n in values]
        effects.append({
            "id": effect.id, "sentence": effect.sentence, "check": effect.check,
            "parameters": [(n, identification.model.parameters[n].status, _sentence(n, values, figures, identification)) for n in names],
        })  # fmt: skip
    return Section("meaning", "What the numbers mean for a valve", {"effects": effects})


def _sentence(name: str, values: Values, figures: KeyFigures, identification: Identification) -> str:
    if name == "lugre.sigma2":
        return _viscous(values, identification)
    if name in SENTENCES:
        return SENTENCES[name](values, figures)
    unit = identification.model.parameters[name].unit
    return f"{in_the_catalogue(name) or name}: {number(values[name])} {unit if unit != '1' else ''}".strip() + "."


def _mass(p: Values, f: KeyFigures) -> str:
    return f"{number(p['mass.m'])} kg move with the stem; it matters only for moves within some tens of milliseconds."


def _spring(p: Values, f: KeyFigures) -> str:
    if not f.rate:
        return "No spring returns the stem: without friction it would drift at the smallest force."
    return (
        f"Every millimetre of travel takes {number(f.rate / 1e3)} N more; over the {f.travel_words} of "
        f"{number(1e3 * f.travel)} mm that is {number(f.span)} N, the span."
    )


def _preload(p: Values, f: KeyFigures) -> str:
    if not f.rate:
        return f"A constant force of {number(p['spring.F0'])} N acts on the stem: weight, mean flow force or a sensor's offset."
    pressure = f", {number(p['spring.F0'] / f.area / 1e3)} kPa on the diaphragm" if f.area else ""
    full = (
        f"; at full stroke it is {number(f.bench_set[1] / 1e3)} kPa, which closes the bench set" if f.bench_set else ""
    )
    return f"At x = 0 the spring already holds {number(p['spring.F0'])} N{pressure}{full}."


def _coulomb(p: Values, f: KeyFigures) -> str:
    text = f"A stem that moves needs {number(p['lugre.fc'])} N against packing and guides; to reverse it, the actuator force must change by {number(2 * p['lugre.fc'])} N"
    pressure = f" ({number(f.swing / 1e3)} kPa)" if f.swing else ""
    lost = f", which loses {number(1e3 * f.dead_band)} mm of travel" if f.dead_band else ""
    return f"{text}{pressure}{lost}."


def _static(p: Values, f: KeyFigures) -> str:
    if p["lugre.fs"] <= p["lugre.fc"]:
        return f"Near rest the friction is {number(p['lugre.fs'])} N, not above that at speed: this stem creeps rather than sticks and slips."
    jump = f"; once free it jumps by at least {number(1e3 * f.jump)} mm" if f.jump else ""
    return f"It takes {number(p['lugre.fs'])} N to break the stem away, {percent(p['lugre.fs'] / p['lugre.fc'] - 1)} more than to keep it moving{jump}."


def _stribeck(p: Values, f: KeyFigures) -> str:
    return f"Below about {number(1e3 * p['lugre.vs'])} mm/s the friction passes from its level at speed to that at rest: moves slower than this tend to stick and slip."


def _stiffness(p: Values, f: KeyFigures) -> str:
    give = 1e6 * p["lugre.fs"] / p["lugre.sigma0"] if p["lugre.sigma0"] else float("inf")
    return f"Before it breaks away the stem gives by {number(give)} µm, springing back when the force is taken off: moves smaller than this are elastic."


def _damping(p: Values, f: KeyFigures) -> str:
    return f"{number(p['lugre.sigma1'])} N s/m damp this elastic give; it shows for some milliseconds after a change of force and hardly matters to a valve."


def _viscous(p: Values, identification: Identification) -> str:
    fastest = max(float(np.nanmax(np.abs(r.trajectory.velocity), initial=0.0)) for r in runs(identification))
    return f"Friction grows by {number(p['lugre.sigma2'] / 1e3)} N for every mm/s: at the fastest recorded {number(1e3 * fastest)} mm/s by {number(p['lugre.sigma2'] * fastest)} N."


SENTENCES: dict[str, Callable[[Values, KeyFigures], str]] = {
    "mass.m": _mass, "spring.K": _spring, "spring.F0": _preload, "lugre.fc": _coulomb, "lugre.fs": _static,
    "lugre.vs": _stribeck, "lugre.sigma0": _stiffness, "lugre.sigma1": _damping,
}  # fmt: skip
"""Sentences by parameter; a parameter of another effect gets the catalogue's words."""
