"""The actuator as a served plant: the numbers of a simulation, and commands that act, or are refused, as a whole."""

from __future__ import annotations

import asyncio
import math
from dataclasses import replace

import numpy as np
import pytest

from bristle.cli.plant_options import ActuatorOptions
from bristle.door.plants import actuator
from hil import (
    ActuatorPlant,
    ActuatorSetup,
    Polling,
    RegisterMap,
    Server,
    ServerSettings,
    WriteMap,
    listen_address,
    open_source,
    valves_of,
)
from recordings import BadInput
from simulator import BASE, CATALOGUE, Effect, Parameter, Site
from simulator.damadics import Fault, run_scenario, scenario


def samples(plant, n, seed=0):
    """n samples in blocks of any size."""
    blocks, random = [{name: np.array([value]) for name, value in plant.signals().items()}], np.random.default_rng(seed)
    done = 1
    while done < n:
        size = min(int(random.integers(1, 400)), n - done)
        blocks.append(plant.advance(size))
        done += size
    return {name: np.concatenate([block[name] for block in blocks]) for name in blocks[0]}


@pytest.mark.parametrize(("form", "noise"), [("play", False), ("play", True), ("lugre", False)])
def test_served_in_blocks_it_gives_the_numbers_of_a_simulation(form, noise):
    what = scenario("chapter5-f11")
    plant = ActuatorPlant(ActuatorSetup(form, what.stimulus, faults=what.faults, noise=noise, seed=3))
    seen = samples(plant, 4001)
    recording, _ = run_scenario("chapter5-f11", form, noise, 3, duration=10.0)
    for name in ("position", "pressure", "drive", "mass_flow", "upstream_pressure", "supply_pressure", "temperature"):
        assert np.array_equal(seen[name], recording[name].values), name
    assert np.allclose(seen["flow"], recording["flow"].values, rtol=1e-12)
    assert np.allclose(seen["setpoint"], recording["setpoint"].values / 100, rtol=1e-12)
    assert np.array_equal(seen["plant_time"], recording.time)


def test_a_commanded_input_leaves_the_stimulus_and_the_others_stay():
    plant = ActuatorPlant(ActuatorSetup(stimulus=scenario("healthy").stimulus))
    plant.apply({"setpoint": 0.25, "temperature": 60.0})
    seen = plant.advance(1000)
    assert set(seen["setpoint"]) == {0.25}
    assert np.ptp(seen["upstream_pressure"]) > 1e5
    assert plant.settings()["setpoint"] == 0.25
    assert plant.signals()["temperature"] == pytest.approx(60.0)


def test_an_ordered_fault_starts_grows_and_ends_when_it_should():
    plant = ActuatorPlant(ActuatorSetup())
    plant.apply({"fault": 1, "fault_strength": 0.75, "fault_from": 1.0, "fault_until": 2.0})
    active = plant.advance(1000)["fault_active"]
    assert np.flatnonzero(np.diff(active, prepend=0.0, append=0.0)).tolist() == [399, 799]
    plant.apply({"fault": 0})
    assert plant.settings()["fault_strength"] == 0.75
    plant.reset()
    assert not plant.advance(600)["fault_active"].any()


def test_an_ordered_fault_comes_on_top_of_those_of_the_scenario():
    plant = ActuatorPlant(ActuatorSetup(faults=(Fault(18, 0.2),)))
    plant.apply({"setpoint": 1.0})
    closed = plant.advance(12_000)["mass_flow"][-1]
    assert 1.0 < closed < 40.0  # the bypass of f18 alone
    plant.apply({"fault": 19, "fault_strength": 0.5, "fault_direction": 1})
    assert plant.advance(10)["mass_flow"][-1] == pytest.approx(0.5 * closed, rel=1e-3)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"fault": 1, "fault_direction": -1}, "direction 1 only"),
        ({"fault": 4.5}, "whole numbers"),
        ({"fault": 20}, "numbered 1 to 19"),
        ({"fault": 4, "fault_strength": 2.0}, "0 to 1"),
        ({"fault": 4, "fault_from": 9.0, "fault_until": 3.0}, "stops after it starts"),
        ({"lugre.fc": 200.0}, "form 'lugre'"),
        ({"lugre": 1, "lugre.fc": -1.0}, "fc is -1"),
        ({"hidden_effect": 1}, "set the plant up with an effect"),
    ],
)
def test_an_impossible_order_changes_nothing(changes, words):
    plant, untouched = ActuatorPlant(ActuatorSetup()), ActuatorPlant(ActuatorSetup())
    before = dict(plant.settings())
    with pytest.raises(BadInput, match=words):
        plant.apply({"setpoint": 0.9, **changes})
    assert plant.settings() == pytest.approx(before, nan_ok=True)
    assert np.array_equal(plant.advance(500)["position"], untouched.advance(500)["position"])


def test_friction_can_be_changed_while_it_runs_and_switching_its_form_starts_anew():
    plant = ActuatorPlant(ActuatorSetup("lugre"))
    plant.advance(400)
    plant.apply({"lugre.fc": 800.0, "lugre.fs": 900.0})
    assert plant.settings()["lugre.fc"] == 800.0
    assert plant.signals()["plant_time"] == pytest.approx(1.0)
    plant.advance(400)
    plant.apply({"lugre": 0})
    assert (plant.signals()["plant_time"], plant.settings()["lugre"]) == (0.0, 0.0)
    with pytest.raises(BadInput, match="form 'lugre'"):
        plant.apply({"lugre.fc": 800.0})
    fresh = ActuatorPlant(ActuatorSetup())
    fresh.advance(100)
    fresh.apply({"lugre": 1})
    assert fresh.signals()["plant_time"] == 0.0
    assert math.isfinite(fresh.settings()["lugre.fc"])


def test_noise_can_be_switched_and_differs_between_units():
    first, second = (ActuatorOptions(noise=True, seed=5).plant(number) for number in (0, 1))
    ours, theirs = (plant.advance(400)["upstream_pressure"] for plant in (first, second))
    assert np.abs(ours - theirs).max() > 1e3
    first.apply({"noise": 0})
    assert np.ptp(first.advance(400)["upstream_pressure"]) == 0.0


EXTRA = [effect for effect in CATALOGUE.effects if effect.id not in BASE]


@pytest.mark.parametrize("effect", EXTRA, ids=lambda effect: effect.id)
def test_a_hidden_effect_can_be_switched_and_changes_nothing_while_it_is_off(effect):
    what = scenario("chapter5-healthy").stimulus
    sizes = {p.symbol: p.scale for p in effect.parameters}
    plain = ActuatorPlant(ActuatorSetup("lugre", what))
    off = ActuatorPlant(ActuatorSetup("lugre", what, hidden={effect.id: sizes}, hidden_on=False))
    on = ActuatorPlant(ActuatorSetup("lugre", what, hidden={effect.id: sizes}))
    without = plain.advance(2000)["position"]
    assert np.abs(off.advance(2000)["position"] - without).max() < 1e-9
    assert off.settings()["hidden_effect"] == 0.0
    off.apply({"hidden_effect": 1})
    off.reset()
    assert np.array_equal(off.advance(2000)["position"], on.advance(2000)["position"])


@pytest.mark.parametrize("allowed", [True, False])
def test_an_undeclared_effect_is_switched_on_over_the_wire_where_that_is_allowed(allowed):
    options = ActuatorOptions(friction="lugre", settings=("setpoint=1.0",), effects=("force_gain:g=-0.2",))
    server_side = ServerSettings(
        [listen_address("tcp://127.0.0.1:0")],
        RegisterMap.load("damadics"),
        WriteMap.load("damadics-write"),
        speed=None,
        harm=allowed,
    )

    async def closed_after(*orders: tuple[str, float]) -> float:
        plants = {1: replace(options, effects_on=False).plant()}
        async with Server(plants, server_side) as server:
            client = {"write_map": WriteMap.load("damadics-write"), "allow_write": True}
            valves = valves_of(RegisterMap.load("damadics"), names=("LC74",))
            async with open_source(server.addresses[0], valves, Polling(100.0), **client) as source:
                await anext(source)  # the link is up
                for name, value in (*orders, ("advance", 2000)):
                    await source.write("LC74", name, value)
            return plants[1].signals()["position"]

    if not allowed:
        with pytest.raises(BadInput, match="illegal data address"):
            asyncio.run(closed_after(("hidden_effect", 1)))
        return
    undeclared = options.plant()
    undeclared.advance(2000)
    healthy = asyncio.run(closed_after())
    assert asyncio.run(closed_after(("hidden_effect", 1))) == pytest.approx(undeclared.signals()["position"], rel=1e-12)
    assert healthy > 1.05 * undeclared.signals()["position"]  # the diaphragm pushes with four fifths of its area only


def test_options_become_the_plant_they_describe():
    options = ActuatorOptions(
        scenario="example1",
        friction="lugre",
        faults=("4:strength=0.5,from=2,develop=0,until=3,direction=-1", "f18"),
        settings=("lugre.fc=321", "gain=40", "setpoint=0.75"),
        seed=7,
    )
    plant = options.plant()
    settings = plant.settings()
    assert (settings["lugre.fc"], settings["setpoint"], settings["lugre"]) == (321.0, 0.75, 1.0)
    seen = plant.advance(1300)
    assert set(seen["setpoint"]) == {0.75}
    assert seen["fault_active"].all()  # f18 from the start, f4 in between


class Cord(Effect):
    """An elastic cord tied to the stem: an effect of one's own."""

    id = "cord"
    site = Site.FORCE
    sentence = "A cord holds the stem"
    parameters = (Parameter("stiffness", "N/m", "of the cord", scale=2e4, neutral=0.0),)

    def force(self, q, p, s, ds):
        return p["stiffness"] * q.x


def test_an_effect_of_ones_own_is_served_and_switched():
    ours, sizes = CATALOGUE.extended(Cord()), {"cord": {"stiffness": 1e5}}
    tied = actuator(None, "lugre", (), {"setpoint": 0.7}, sizes, catalogue=ours, effects_on=False)
    free = actuator(None, "lugre", (), {"setpoint": 0.7}, {})
    assert np.allclose(tied.advance(2000)["position"], free.advance(2000)["position"], rtol=1e-12)
    tied.apply({"hidden_effect": 1})
    assert abs(tied.advance(2000)["position"][-1] - free.advance(2000)["position"][-1]) > 1e-4
    with pytest.raises(BadInput, match="cord"):
        actuator(None, "lugre", (), {}, sizes)
