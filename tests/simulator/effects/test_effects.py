"""The contract of effects: every entry of the catalogue gets every check, and every check catches what it is for."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest
from effect_contract import CHECKS, Subject
from sample_effects import SAMPLES, Backlash, Drag, InputLag, SensorLag, TightSpot

from simulator import BASE, CATALOGUE, Catalogue, Parameter, Site

SUBJECTS = [Subject(effect, CATALOGUE) for effect in CATALOGUE.effects]
SAMPLE_SUBJECTS = [Subject(effect, CATALOGUE.extended(*SAMPLES)) for effect in SAMPLES]

TABLE = {
    **dict.fromkeys(BASE, "force"),
    **dict.fromkeys(
        ["asymmetric_coulomb", "asymmetric_viscous", "position_dependent_friction", "load_dependent_friction",
         "dwell_stiction", "frictional_memory", "nonlocal_presliding", "friction_drift", "quadratic_drag",
         "hardening_spring", "contact_stiffness", "flow_force", "periodic_force", "position_periodic_force",
         "force_offset_drift"], "force"),
    **dict.fromkeys(["force_gain", "actuator_lag", "actuator_hysteresis"], "input"),
    "dead_time": "input or output",
    **dict.fromkeys(["backlash", "sensor_lag", "sensor_nonlinearity", "sensor_drift"], "output"),
}  # fmt: skip
"""The ids that commands and files use, with their sites. An effect that is not among them may have any other id."""


def name_of(value):
    return value.effect.id if isinstance(value, Subject) else value.__name__


@pytest.mark.parametrize("check", CHECKS, ids=name_of)
@pytest.mark.parametrize("subject", SUBJECTS + SAMPLE_SUBJECTS, ids=name_of)
def test_contract(subject, check):
    check(subject)
    assert check.__doc__


@pytest.mark.parametrize("effect", CATALOGUE.effects, ids=lambda effect: effect.id)
def test_an_effect_is_one_file_with_its_name_and_site(effect):
    folders = {"force", "friction"} if effect.site is Site.FORCE else {effect.site.value}
    assert type(effect).__module__ in {f"simulator.effects.{folder}.{effect.id}" for folder in folders}
    assert effect.site.value in TABLE.get(effect.id, effect.site.value)


def test_the_catalogue_starts_with_the_base_effects_and_has_every_id_that_is_promised():
    assert CATALOGUE.ids[: len(BASE)] == BASE
    assert set(TABLE) <= set(CATALOGUE.ids)


@pytest.mark.parametrize("effect", [e for e in CATALOGUE.effects if e.id not in BASE], ids=lambda effect: effect.id)
def test_every_effect_beside_the_base_has_a_first_guess_of_its_own(effect):
    assert "first_guess" in vars(type(effect))


class Pushing(Drag):
    """A drag with the wrong sign."""

    def force(self, q, p, s, ds):
        return -p["c"] * q.v * ca.fabs(q.v)


class Always(TightSpot):
    """A neutral value that is not."""

    def friction_level(self, q, p, s):
        return 1.01 + super().friction_level(q, p, s) - 1


class Hidden(Drag):
    """An effect that vanishes twice at its neutral value."""

    def force(self, q, p, s, ds):
        return p["c"] ** 2 / 5e3 * q.v * ca.fabs(q.v)


class Undifferentiable(Drag):
    """An effect whose equations hide a parameter from differentiation."""

    def force(self, q, p, s, ds):
        return p["c"] * q.v * ca.fabs(q.v) + 0.1 * ca.floor(p["c"] * 1e4)


class Redundant(Drag):
    """Two parameters for one thing."""

    parameters = (*Drag.parameters, Parameter("more", "N s2/m2", "the same again", scale=4e3, neutral=0.0))

    def force(self, q, p, s, ds):
        return (p["c"] + p["more"]) * q.v * ca.fabs(q.v)


class Loose(Backlash):
    """Memory that nothing moves."""

    def jump(self, q, p, s):
        return {}


class Misplaced(SensorLag):
    """An output effect that pushes."""

    def force(self, q, p, s, ds):
        return p["tau"]


class Unbounded(InputLag):
    """A typical value beyond its bound."""

    parameters = (Parameter("tau", "s", "time constant", scale=0.02, lower=0.1, neutral=0.1),)


class Exotic(Drag):
    """An operation that only a C compiler knows."""

    def force(self, q, p, s, ds):
        return p["c"] * q.v * ca.fabs(q.v) * ca.erfinv(ca.tanh(q.x))


class Overbending(Drag):
    """A guess with a mass below nothing."""

    def first_guess(self, recordings, base):
        return [{"sample_drag.c": 1.0, "mass.m": -base["mass.m"]}]


class Shouting(Drag):
    """A sentence that cannot be put into another."""

    sentence = "Drag."


@pytest.mark.parametrize(
    ("broken", "caught", "said"),
    [
        (Pushing, "passive", "delivers energy"),
        (Always, "neutral", "neutral changes the force-driven"),
        (Hidden, "derivative_at_neutral", "vanishes"),
        (Undifferentiable, "derivative", "derivative by c, force-driven"),
        (Redundant, "recovery", "sample_drag.more"),
        (Loose, "memory", "laws and jumps for"),
        (Misplaced, "hooks", "an effect on the output has"),
        (Unbounded, "parameters", "the scale lies inside"),
        (Exotic, "portable", "without a C compiler"),
        (Overbending, "first_guess", "guesses mass.m to be -"),
        (Shouting, "words", "no capital"),
    ],
    ids=lambda value: getattr(value, "__name__", ""),
)
def test_the_contract_catches_a_broken_effect(broken, caught, said):
    subject = Subject(broken(), CATALOGUE.extended(broken()))
    with pytest.raises(AssertionError, match=said):
        {check.__name__: check for check in CHECKS}[caught](subject)


def test_a_catalogue_holds_every_name_once():
    with pytest.raises(ValueError, match="'sample_drag' twice"):
        Catalogue((Drag(), Drag()))
    with pytest.raises(ValueError, match=r"sample_drag\.c"):
        CATALOGUE.extended(Drag(), type("Other", (Drag,), {"id": "other", "prefix": "sample_drag"})())
    assert "sample_drag" not in CATALOGUE
    assert CATALOGUE.extended(Drag())["sample_drag"].site is Site.FORCE
    assert np.all([CATALOGUE[i].id == i for i in CATALOGUE.ids])
