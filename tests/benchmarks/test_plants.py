"""The plant that judges `trace`: its accuracy, its effects, and that its recordings keep their secret."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from benchmarks.plants import cases, strengths
from benchmarks.plants.cases import COURSE, Case, Run, force_course, runs
from benchmarks.plants.effects import OTHER, OUTSIDE, SAME, Valve, fields_of, law
from benchmarks.plants.integration import integrate
from benchmarks.plants.recordings import recordings, save
from benchmarks.plants.truth import true_values
from recordings import read, read_truth
from simulator import BASE, CATALOGUE, kernel

SEED = 9
NEUTRAL = {"saturated_sensor": -1.0}
"""The strength at which an effect does nothing, where it is not 0."""


@pytest.fixture(scope="module")
def valve() -> Valve:
    return Valve.of(SEED)


@pytest.fixture
def short(monkeypatch: pytest.MonkeyPatch) -> None:
    """Experiments of a few seconds."""
    monkeypatch.setattr(cases, "SECONDS", {"staircase": 4.0, "sine": 5.0, "multisine": 4.0})


@pytest.fixture(scope="module")
def force(valve: Valve) -> np.ndarray:
    return force_course(valve, "sine", 4.0, 0)


@pytest.mark.slow
def test_plant_agrees_with_radau(valve: Valve, force: np.ndarray) -> None:
    b = valve.values
    t = np.arange(501) / COURSE

    def motion(now: float, state: np.ndarray) -> tuple[float, float, float]:
        x, v, z = state
        level = b["lugre.fc"] + (b["lugre.fs"] - b["lugre.fc"]) * np.exp(-((v / b["lugre.vs"]) ** 2))
        slip = v - b["lugre.sigma0"] * abs(v) * z / level
        friction = b["lugre.sigma0"] * z + b["lugre.sigma1"] * slip + b["lugre.sigma2"] * v
        return v, (np.interp(now, t, force[:501]) - b["spring.K"] * x - b["spring.F0"] - friction) / b["mass.m"], slip

    start = [(force[0] - b["spring.F0"]) / b["spring.K"], 0.0, 0.0]
    found = solve_ivp(motion, (0, 1), start, "Radau", t, rtol=1e-10, atol=[1e-13, 1e-11, 1e-15], max_step=0.01)
    assert np.ptp(found.y[0]) > 1e-4
    assert np.abs(integrate(valve.physics(), force[:501], COURSE)[:, 0] - found.y[0]).max() < 1e-9


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_base_agrees_with_the_kernel(seed: int) -> None:
    valve = Valve.of(seed)
    force = force_course(valve, "staircase", 8.0, 0)
    mine = integrate(valve.physics(), force, COURSE)
    assert np.abs(mine[:, 0] - modelled(force, valve.values, (), 1e-5)).max() < 3e-8


def modelled(force: np.ndarray, values: dict[str, float], effects: tuple[str, ...], step: float = 5e-5) -> np.ndarray:
    """The position by the kernel, with effects of the catalogue beside the base."""
    model = kernel((*BASE, *effects))
    start = model.start((force[0] - values["spring.F0"]) / values["spring.K"], 0.0, force[0])
    t = np.arange(len(force)) / COURSE
    return model.run(t, force, model.vector(values), start, h_max=step).outputs[:, 0]


@pytest.mark.parametrize("effect", SAME)
def test_same_law_agrees_with_the_catalogue(effect: str, valve: Valve, force: np.ndarray) -> None:
    mine = integrate(valve.physics(law(effect)(0.3, valve)), force, COURSE)[:, 0]
    difference = np.abs(mine - modelled(force, true_values({effect: 0.3}, valve), (effect,)))
    moved = np.abs(mine - integrate(valve.physics(), force, COURSE)[:, 0])
    assert moved.max() > 1e-6
    near = 0.03 if effect == "dwell_stiction" else 0.01  # its rise is wiped out by another formula
    assert np.sqrt(np.mean(difference**2)) < near * np.sqrt(np.mean(moved**2)) + 1e-8


def test_every_effect_of_the_catalogue_has_a_law() -> None:
    assert {*SAME} == {*CATALOGUE.ids} - {*BASE}
    assert {*OTHER} <= {*SAME}
    assert not {*OUTSIDE} & {*CATALOGUE.ids}
    assert len(OUTSIDE) >= 5


@pytest.fixture(scope="module")
def plain(valve: Valve) -> dict[str, np.ndarray]:
    return {shape: run.reading for shape, run in shortly(Case(SEED), {}).items()}


def shortly(case: Case, strengths: dict[str, float]) -> dict[str, Run]:
    """A staircase of 4 s, in which the clamp closes too."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(cases.SECONDS, "staircase", 4.0)
        patch.setattr(cases, "CLAMPS", 1.0)
        return runs(case, strengths, ["staircase"], 1e-4)


@pytest.mark.parametrize(
    ("effect", "form"),
    [*((e, "same") for e in [*SAME, *OUTSIDE] if e != "friction_jump"), *((e, "other") for e in OTHER)],
)
def test_effect_vanishes_at_zero_and_shows_above(effect: str, form: str, plain: dict[str, np.ndarray]) -> None:
    case = Case(SEED, (effect,), form=form)
    off, on = (shortly(case, {effect: s})["staircase"].reading for s in (NEUTRAL.get(effect, 0.0), 0.4))
    assert np.abs(off - plain["staircase"]).max() < 1e-12
    assert np.abs(on - plain["staircase"]).max() > 1e-6


def test_friction_jumps_at_its_instant(valve: Valve, force: np.ndarray) -> None:
    before, after = (integrate(valve.physics({"jump": s, "jump_t": 2.0}), force, COURSE)[:, 0] for s in (0.0, 0.4))
    assert np.abs(before - after)[:1001].max() == 0.0
    assert np.abs(before - after)[1001:].max() > 1e-6


def test_effects_that_claim_one_field_are_refused(valve: Valve, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(OUTSIDE, "another_drift", lambda s, v: {"drift": s})
    with pytest.raises(ValueError, match="another_drift cannot be combined"):
        fields_of({"friction_drift": 0.1, "another_drift": 0.1}, valve)


def test_recordings_are_seeded_and_tell_nothing(short: None, tmp_path) -> None:
    case = Case(SEED, seed=3)
    fitted, held_out, _ = recordings(case)
    again = recordings(case)[0]
    assert [r.title for r in (*fitted, *held_out)] == ["staircase", "sine", "multisine"]
    assert all((a["position"].values == b["position"].values).all() for a, b in zip(fitted, again, strict=True))
    assert save(case, tmp_path) == {}
    stored = read(tmp_path / "sine.h5")
    assert {*stored} == {"time", "force", "position"}
    assert not stored.attributes
    assert not stored.events
    assert stored.plant.known() == {"stroke_m": Valve.of(SEED).stroke}
    assert read_truth(tmp_path / "sine.h5")["effects"] == " ".join(BASE)


@pytest.mark.parametrize(("slow", "rows"), [("both", 101), ("position", 501)])
def test_slow_sampling(slow: str, rows: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cases, "SECONDS", {"sine": 1.0, "multisine": 1.0})
    (recording,), _, _ = recordings(Case(SEED, rate=100.0, slow=slow))
    assert len(recording) == rows
    assert np.isfinite(recording["position"].values).sum() == 101


def test_noise_is_what_the_valve_says(short: None) -> None:
    valve, case = Valve.of(SEED), Case(SEED, noise=2.0)
    (stairs, _), _, _ = recordings(case)
    run = runs(case, {})["staircase"]
    assert np.std(stairs["position"].values - run.reading) == pytest.approx(2 * valve.position_noise, rel=0.05)
    assert np.std(stairs["force"].values - run.force) == pytest.approx(valve.force_noise, rel=0.05)


@pytest.mark.long
def test_calibrated_strength_leaves_what_was_asked_for() -> None:
    found = strengths.calibrated("backlash", SEED, "same", (3.0, 6.0))
    left = strengths.Remaining(Case(SEED, ("backlash",)))
    assert found[6.0][1] == pytest.approx(6.0, rel=0.13)
    assert left(found[6.0][0]) == pytest.approx(6.0, rel=0.2)
    assert found[3.0][0] < found[6.0][0]


@pytest.mark.slow
def test_what_the_base_takes_over_leaves_hardly_anything_although_it_moves_slips() -> None:
    """A tenth more mass and three times the bristles' damping stand for this drag; slips come and go on the way."""
    left = strengths.Remaining(Case(11151, ("quadratic_drag",)))
    assert left(0.249) < 0.5
