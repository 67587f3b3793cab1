"""While a detector is learned: what is judged already, how often a false alarm would come, and what was seen."""

from __future__ import annotations

import asyncio
from itertools import islice

import pytest
from monitor_rig import broken_file

from bristle.cli.app import run
from detector import described
from hil import Monitor, open_source
from recordings import read
from simulator import ValveModel

LEARN_S = 40.0


@pytest.fixture(scope="module")
def fitted(model, tmp_path_factory):
    """The model with what a fit says of its own uncertainty."""
    known = ValveModel.read(model)
    parameters = {
        name: one.model_copy(update={"std": 0.01 * one.value, "status": "identified"})
        for name, one in known.parameters.items()
    }
    told = {"noise": {"position_m": 6e-5, "force_N": 45.0}, "error": {"fit": {"rmse_m": 1e-4}}}
    path = tmp_path_factory.mktemp("fitted") / "model.json"
    known.model_copy(update={"parameters": parameters} | told).write(path)
    return path


def learning(model, path, samples=None) -> Monitor:
    """A monitor that has seen so many samples of a recording, all of them without a number."""

    async def story() -> Monitor:
        async with open_source(f"replay:{path}", name="V") as source:
            monitor = Monitor.with_model(source.signals, ValveModel.read(model), 30.0, LEARN_S)
            items = [item async for item in source]
            for item in islice(items, samples):
                await monitor.take(item)
            return monitor

    return asyncio.run(story())


@pytest.mark.slow
def test_the_model_alone_judges_from_the_first_second_and_the_rate_grows(fitted, healthy):
    early, later = (learning(fitted, healthy, n).status[0] for n in (100, 1000))
    for status in (early, later):
        assert status.phase == "learning"
        assert status.judged.startswith("link, values, and by the model alone the forces are judged: as usual")
        assert status.supported.startswith(f"false alarms: {status.gathered_s:.2g} s fault-free support at most one in")
    assert later.strokes > early.strokes


@pytest.mark.slow
def test_a_fault_while_it_learns_is_said_and_goes_with_what_was_learned(fitted, healthy, tmp_path):
    broken = broken_file(healthy, tmp_path / "broken.h5", after_s=10.0)
    status = learning(fitted, broken, 1900).status[0]
    assert "has changed" in status.judged or "unlike it was learned" in status.judged
    (valve,) = learning(fitted, broken).valves.values()
    assert valve.watch is not None
    assert "while it was learned, its model alone said" in described(valve.watch)


def test_without_standard_deviations_only_link_and_values_are_judged_and_it_says_why(model, healthy):
    status = learning(model, healthy, 100).status[0]
    assert "link and values are judged" in status.judged
    assert "no standard deviations" in status.judged


@pytest.mark.slow
def test_what_ends_while_it_learns_says_what_was_judged(fitted, healthy, capsys):
    length = read(healthy).time[-1]
    assert run(["replay", str(healthy), "--model", str(fitted), "--learn", f"{10 * length:.0f}"]) == 1
    said = capsys.readouterr().err
    assert "by the model alone the forces are judged: as usual" in said
    assert "still learning" in said
