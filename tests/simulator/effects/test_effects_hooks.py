"""The hooks of effects: what they are given, in which order they are asked, and how accurate the step is with them."""

from __future__ import annotations

import itertools

import casadi as ca
import numpy as np
import pytest
from lugre_reference import STROKE, Valve, slow_force, solve
from sample_effects import (
    SAMPLES,
    Backlash,
    CurvedScale,
    Drag,
    Dwell,
    InputLag,
    InputPlay,
    SensorLag,
    Slip,
    TightSpot,
    played,
)

from recordings import BadInput
from simulator import BASE, CATALOGUE, Effect, Lag, Memory, Parameter, Recurrence, Scanner, Site, kernel
from simulator.compile.step import force_driven

T = np.linspace(0.0, 1.2, 601)
VALVE = Valve()
VALUES = VALVE.values() | {e.parameter_name(p.symbol): p.scale for e in SAMPLES for p in e.parameters}
REST = (slow_force(0.0) - VALVE.F0) / VALVE.K


def simulate(effects, h, values=VALUES, t=T):
    """Position at the times t for effects of our own behind the base, force sampled with a step h."""
    k = kernel((*BASE, *(e.id for e in effects)), catalogue=CATALOGUE.extended(*effects))
    fine = np.linspace(t[0], t[-1], round((t[-1] - t[0]) / h) + 1)
    scan = k.run(fine, slow_force(fine), k.vector(values), k.start(REST, force=slow_force(0.0)))
    assert scan.failed is None
    return scan.outputs[:: (len(fine) - 1) // (len(t) - 1), 0]


def order(effects, values=VALUES):
    """Observed order against a run with a step 16 times finer than the finest."""
    steps = (2.5e-4, 1.25e-4, 6.25e-5, 3.125e-5)
    finest = simulate(effects, steps[-1] / 16, values)
    errors = [np.sqrt(((simulate(effects, h, values) - finest) ** 2).mean()) for h in steps]
    return np.polyfit(np.log(steps), np.log(errors), 1)[0]


@pytest.mark.parametrize("effect", SAMPLES, ids=lambda effect: effect.id)
def test_the_step_stays_of_second_order_with_an_effect(effect):
    assert 1.85 < order((effect,)) < 2.3


@pytest.mark.parametrize(
    ("effect", "name"), [(InputLag(), "sample_input_lag.tau"), (SensorLag(), "sample_sensor_lag.tau")]
)
@pytest.mark.parametrize("tau", [0.0, 1e-6, 1e-4, 1e-2])
def test_lags_are_of_second_order_however_short(effect, name, tau):
    assert 1.85 < order((effect,), VALUES | {name: tau}) < 2.3


def reference(output_effects, t):
    """All force and input samples at once by Radau, then the sensors at the fine times t, in the given order."""
    p = {name: value for name, value in VALUES.items() if name.startswith("sample")}

    def motion(now, state):
        x, v, z, u, rest = state
        spot = 1 + p["sample_tight_spot.a"] * np.exp(
            -(((x - p["sample_tight_spot.x0"]) / p["sample_tight_spot.w"]) ** 2)
        )
        dwell = 1 + p["sample_dwell.a"] * (1 - np.exp(-rest / p["sample_dwell.tau"]))
        friction, dz = VALVE.friction(v, z, spot * dwell)
        drag = p["sample_drag.c"] * v * abs(v)
        a = (u - VALVE.K * x - VALVE.F0 - friction - drag) / VALVE.m
        lag = (slow_force(now) - u) / p["sample_input_lag.tau"]
        return v, a, dz, lag, 1 - abs(v) * rest / p["sample_dwell.d"]

    y = solve(motion, [REST, 0.0, 0.0, slow_force(0.0), 0.0], t)[0]
    for sensor in output_effects:
        y = sensor(y, t[1] - t[0])
    return y


def play(x, _h):
    """Backlash along a finely sampled path, element by element."""
    half, held, out = VALUES["sample_backlash.b"] / 2, x[0], []
    for drive in x:
        held = min(max(held, drive - half), drive + half)
        out.append(held)
    return np.array(out)


def lag(x, h):
    """First-order lag along a finely sampled path, by the trapezoidal rule."""
    r, out = 2 * VALUES["sample_sensor_lag.tau"] / h, [x[0]]
    for before, now in itertools.pairwise(x):
        out.append(((r - 1) * out[-1] + before + now) / (r + 1))
    return np.array(out)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("effects", "sensors"), [((Backlash(), SensorLag()), (play, lag)), ((SensorLag(), Backlash()), (lag, play))],
    ids=["backlash first", "lag first"],
)  # fmt: skip
def test_all_hooks_together_follow_an_independent_solution(effects, sensors):
    # The catalogue's order decides within a group of effects; across groups, here forces before inputs, it does not.
    ours = (Drag(), TightSpot(), Dwell(), *effects, InputLag())
    fine = np.linspace(0, 0.8, 40001)
    expected = reference(sensors, fine)[::100]
    found = simulate(ours, 4e-5, t=fine[::100])
    assert abs(found - expected).max() < 1e-5 * STROKE
    swapped = reference(sensors[::-1], fine)[::100]
    assert abs(found - swapped).max() > 1e-3 * STROKE


def test_effects_run_without_a_compiler(monkeypatch):
    def run(sensitivities):
        effects = (InputLag(), TightSpot(), Backlash())
        k = kernel((*BASE, *(e.id for e in effects)), catalogue=CATALOGUE.extended(*effects))
        start = k.start(REST, force=slow_force(0.0))
        return k.run(T, slow_force(T), k.vector(VALUES), start, sensitivities=sensitivities)

    compiled = run(sensitivities=True)
    monkeypatch.setenv("BRISTLE_NO_COMPILER", "1")
    monkeypatch.setattr("simulator.compile.numba_loop.LARGE", 0)  # derivatives in a module of their own
    plain, full = run(sensitivities=False), run(sensitivities=True)
    assert plain.outputs == pytest.approx(compiled.outputs, rel=1e-12)
    assert full.outputs == pytest.approx(compiled.outputs, rel=1e-12)
    largest = abs(compiled.jacobian).max(axis=(0, 1))
    assert (abs(full.jacobian - compiled.jacobian).max(axis=(0, 1)) <= 1e-10 * largest).all()


def test_effects_are_asked_in_the_order_of_what_they_shape():
    asked = []

    def spy(name, site, **hooks):
        def relax(self, q, p):
            asked.append((name, str(q.u), str(q.friction), str(q.y)))
            return {}

        members = {"id": name, "site": site, "parameters": (), "relax": relax, **hooks}
        return type(name, (Effect,), members)()

    effects = (
        spy("sensor", Site.OUTPUT, output=lambda self, q, p, s: ca.SX.sym("sensed")),
        spy("push", Site.FORCE, force=lambda self, q, p, s, ds: q.a),
        spy("level", Site.FORCE, friction_level=lambda self, q, p, s: ca.SX.sym("level")),
        spy("drive", Site.INPUT, input=lambda self, q, p, s: ca.SX.sym("driven")),
        spy("second sensor", Site.OUTPUT, output=lambda self, q, p, s: q.y),
    )
    force_driven(effects)
    once = list(dict.fromkeys(name for name, *_ in asked))
    assert once == ["drive", "level", "push", "sensor", "second sensor"]
    seen = {name: rest for name, *rest in asked}
    assert seen["drive"][0] == "u"
    assert seen["level"][:2] == ["driven", "1.0"]
    assert seen["push"][:2] == ["driven", "level"]
    assert seen["sensor"][2] == "s_0"
    assert seen["second sensor"][2] == "sensed"


class Recorder(Effect):
    """Gives away, as its output, the memory that a jump keeps: time, position, velocity or force."""

    id, site, parameters = "recorder", Site.OUTPUT, (Parameter("which", "1", "what to keep", scale=1.0, neutral=0.0),)
    memory = (Memory("kept", "1"),)
    sentence = check = "for this test"

    def jump(self, q, p, s):
        kept = [q.t, q.x, q.v, q.u]
        return {"kept": sum(ca.if_else(p["which"] == i, value, 0) for i, value in enumerate(kept))}

    def output(self, q, p, s):
        return s["kept"]


def test_a_jump_sees_the_end_of_the_step():
    k = kernel((*BASE, "recorder"), catalogue=CATALOGUE.extended(Recorder()))
    plain = kernel(BASE)
    t = np.linspace(0, 0.4, 201)
    u = slow_force(t)

    def kept(which, **options):
        p = k.vector(VALVE.values() | {"recorder.which": which})
        return k.run(t, u, p, k.start(REST), h_max=5e-4, **options).outputs[1:, 0]

    x = plain.run(t, u, plain.vector(VALVE.values()), plain.start(REST), h_max=5e-4).outputs[1:, 0]
    assert kept(0.0) == pytest.approx(t[1:], abs=1e-12)
    assert kept(1.0) == pytest.approx(x, abs=1e-15)
    assert np.trapezoid(kept(2.0), t[1:]) == pytest.approx(x[-1] - x[0], abs=1e-5)
    assert kept(3.0) == pytest.approx(u[1:], rel=1e-12)
    assert kept(3.0, hold=True) == pytest.approx(u[:-1], rel=1e-12)


def test_inputs_at_the_end_of_a_step_are_asked_for_only_where_they_are_needed():
    def ends(*effects):
        return force_driven((*CATALOGUE.pick(BASE), *effects))[0].ends

    assert not ends()
    assert not ends(Backlash(), SensorLag(), TightSpot(), Slip())
    assert ends(InputLag())
    assert ends(InputPlay())


def test_memory_starts_where_it_says():
    ids = ("sample_backlash", "sample_sensor_lag", "sample_input_lag", "sample_dwell")
    k = kernel((*BASE, *ids), catalogue=CATALOGUE.extended(*SAMPLES))
    start = dict(zip(k.states, k.start(0.012, 0.5, 700.0), strict=True))
    assert start == {
        "x": 0.012, "v": 0.5, "lugre.z": 0.0, "sample_backlash.y": 0.012, "sample_sensor_lag.y": 0.012,
        "sample_input_lag.u": 700.0, "sample_dwell.T": 0.0,
    }  # fmt: skip
    quiet = k.run(np.arange(3.0), np.full(3, 660.0), k.vector(VALUES), k.start(0.012, force=660.0), h_max=1e-3)
    assert quiet.outputs == pytest.approx(0.012, abs=1e-9)


def test_where_the_motion_is_imposed_a_sensor_of_the_position_makes_no_sense():
    with pytest.raises(BadInput, match="sample_backlash acts on the output, and the motion is imposed"):
        kernel((*BASE, "sample_backlash"), "motion", CATALOGUE.extended(Backlash()))


def test_where_the_motion_is_imposed_an_input_effect_changes_the_load():
    """A factor 1.2 on a load of 50 N, which stands in the recorded force once, leaves 10 N less to be recorded."""
    k = kernel((*BASE, "force_gain"), "motion")
    driven = np.column_stack([np.zeros(3), np.zeros(3), np.zeros(3), np.full(3, 50.0)])
    recorded = [
        k.run(np.arange(3.0), driven, k.vector(VALUES | {"force_gain.g": g}), k.start()).outputs[0, 0]
        for g in (0.0, 0.2)
    ]
    assert recorded[1] - recorded[0] == pytest.approx(-10.0)


def test_effects_of_ones_own_need_a_catalogue():
    with pytest.raises(KeyError, match="sample_drag"):
        kernel((*BASE, "sample_drag"))
    k = kernel(("sample_drag", *BASE), catalogue=CATALOGUE.extended(Drag()))
    assert k.effects == (*BASE, "sample_drag")
    assert k.parameters[-1] == "sample_drag.c"


def test_a_lag_follows_a_ramp_exactly():
    s, exo, p = ca.SX.sym("s"), ca.SX.sym("e", 4), ca.SX.sym("p")
    course = Lag(exo[2], p).over(s, exo[1], Lag(exo[3], p))
    scanner = Scanner(Recurrence(s, exo, p, course.end, s, ends=True))
    t = np.array([0.0, 0.3, 0.5, 1.5])
    for tau in (0.0, 1e-12, 1e-3, 0.1, 10.0, 1e6):
        scan = scanner.run(t, 2 * t, np.array([tau]), np.array([1.0]), sensitivities=True)
        decay = np.exp(-t / tau) if tau else (t == 0).astype(float)
        assert scan.outputs[:, 0] == pytest.approx(2 * (t - tau) + (1 + 2 * tau) * decay, rel=1e-9, abs=1e-12)
        slope = -2 * (1 - decay) + (1 + 2 * tau) * decay * (t / tau**2 if tau else 0)
        assert scan.jacobian[:, 0, 0] == pytest.approx(slope, rel=1e-6, abs=1e-9)


def test_the_samples_play_is_a_play():
    s, x = ca.SX.sym("s"), ca.SX.sym("x")
    function = ca.Function("play", [s, x], [played(s, x, 1.0)])
    assert [float(function(0.0, x)) for x in (0.3, 0.5, 2.0, -0.5, -2.0)] == [0, 0, 1.5, 0, -1.5]
    assert CurvedScale.site is Site.OUTPUT
