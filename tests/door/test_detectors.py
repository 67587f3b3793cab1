"""The detector of the door: learned with a model that has an effect of one's own, and how far it is."""

from __future__ import annotations

from typing import Any

import pytest

import bristle as br
from simulator import Value

RARE = 1000.0
"""False alarms a month that a minute of data supports."""


class Magnet(br.Effect):
    """A pull that falls off with the square of the distance."""

    id = "magnet"
    site = br.Site.FORCE
    sentence = "A magnet pulls the stem towards the closed end"
    parameters = (
        br.Parameter("G", "N", "pull at the closed end", scale=50.0, neutral=0.0),
        br.Parameter("D", "m", "distance at which a quarter of it is left", scale=3e-3, lower=1e-3, upper=2e-2),
    )

    def force(self, q: Any, p: Any, s: Any, ds: Any) -> Any:
        return p["G"] / (1.0 + q.x / p["D"]) ** 2


OURS = br.CATALOGUE.extended(Magnet())
PULLED = {"magnet.G": 50.0, "magnet.D": 2e-2}


def simulated(seconds: int, **given: float):
    return br.simulate(
        f"mixed:{seconds}", effects=["magnet"], catalogue=OURS, given=PULLED | given, rate=50, seed=3,
        position_noise=5e-6,
    )  # fmt: skip


@pytest.fixture(scope="module")
def healthy():
    return simulated(60)


@pytest.fixture(scope="module")
def model():
    """What simulated the recordings, as a fit would have it."""
    plain = br.fit(br.simulate("mixed:10", seed=3), crosscheck=False).model
    known = OURS.parameters(["magnet"])
    added = {name: Value(value=PULLED[name], unit=known[name].unit) for name in known}
    return plain.model_copy(update={"effects": (*plain.effects, "magnet"), "parameters": plain.parameters | added})


@pytest.fixture(scope="module")
def learned(healthy, model):
    return br.learn(healthy, model, false_alarms=RARE, catalogue=OURS)


@pytest.mark.slow
def test_a_model_with_an_effect_of_ones_own_is_learned_and_watched(healthy, model, learned):
    assert "magnet" in learned.model.filter.effects
    assert not br.watch(healthy, learned).alarms
    pushed = simulated(15, **{"spring.F0": model.values["spring.F0"] + 200.0})
    assert br.watch(pushed, learned).alarms


@pytest.mark.slow
def test_a_model_file_is_read_with_the_catalogue(healthy, model, learned, tmp_path):
    model.write(tmp_path / "model.json")
    again = br.learn(healthy, tmp_path / "model.json", false_alarms=RARE, catalogue=OURS)
    assert again.as_dict() == learned.as_dict()
    with pytest.raises(br.BadInput, match="there is no effect 'magnet'"):
        br.learn(healthy, tmp_path / "model.json", false_alarms=RARE)


@pytest.mark.slow
def test_an_effect_that_the_catalogue_lacks_is_named(healthy, model, learned):
    with pytest.raises(br.BadInput, match="model: there is no effect 'magnet'; give the catalogue") as said:
        br.learn(healthy, model, false_alarms=RARE)
    assert said.value.parameter == "catalogue"
    with pytest.raises(br.BadInput, match="there is no effect 'magnet'"):
        type(learned).from_dict(learned.as_dict())
    assert type(learned).from_dict(learned.as_dict(), OURS) == learned


def test_learning_and_watching_say_how_far_they_are(healthy):
    stages: list[tuple[str, int, int]] = []
    found = br.learn(healthy, false_alarms=RARE, progress=lambda *how: stages.append(how))
    assert [stage for stage, *_ in stages] == ["observer", "positioner", "model", "flow and pressures"]
    stages.clear()
    seen = br.watch(healthy, found, progress=lambda *how: stages.append(how))
    assert stages[0] == ("samples", 0, len(seen.judgements))
    assert stages[-1] == ("samples", len(healthy), len(healthy))
