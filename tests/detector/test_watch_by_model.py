"""A watch from the model alone: quiet on its valve, loud when that changes, refused when nothing is known."""

from __future__ import annotations

import pytest
from watched_valve import MODEL, TENTH, alarms, seen

from detector import described, learn_model
from recordings import BadInput
from simulator import ValveModel
from simulator.damadics import Fault

ONSET = 60.0


def known(std: float = 0.02, **changes: object) -> ValveModel:
    """The model with what a fit says of its own uncertainty: standard deviations as shares, and a free run's error."""
    parameters = {
        name: one.model_copy(update={"std": std * one.value, "status": "identified"})
        for name, one in MODEL.parameters.items()
    }
    told = {
        "parameters": parameters,
        "noise": {"position_m": 6e-5, "force_N": 45.0},
        "error": {"fit": {"rmse_m": 3e-4}},
    }
    return MODEL.model_copy(update=told | changes)


@pytest.mark.slow
def test_it_watches_from_the_first_sample_and_is_quiet_until_the_valve_changes():
    watch = learn_model(known(), TENTH, {"position", "pressure", "setpoint"})
    assert watch.signals == ("position", "pressure")
    assert watch.false_alarms.seconds <= 80.0
    assert "started from the model alone" in described(watch)
    assert alarms(watch, seen(300.0, seed=5))[0] == []
    found, _ = alarms(watch, seen(ONSET + 50.0, Fault(11, 0.75, start_s=ONSET), seed=6))
    assert found
    assert found[0].time_s > ONSET


def test_what_the_fit_does_not_know_makes_it_less_sensitive():
    sizes = []
    for std in (0.02, 0.3):
        evidence = learn_model(known(std), TENTH, {"force"}).evidence
        sizes.append(dict(zip(evidence.names, (one.size for one in evidence.healthy), strict=True))["energy"])
    assert sizes[1] > 1.2 * sizes[0]


@pytest.mark.parametrize(
    ("model", "signals", "words"),
    [
        (MODEL, {"force"}, "no standard deviations"),
        (known(error={}), {"force"}, "no error of a free run"),
        (known(plant={}), {"force"}, "stroke_m"),
        (known(plant={"stroke_m": 0.0381}), {"pressure"}, "neither a force"),
        (known(), {"setpoint"}, "neither a force"),
    ],
)
def test_a_model_that_does_not_say_how_well_it_is_known_is_refused_in_words(model, signals, words):
    with pytest.raises(BadInput, match=words):
        learn_model(model, TENTH, signals)


def test_an_unresolved_parameter_is_named():
    model = known()
    loose = model.parameters["lugre.fc"].model_copy(update={"status": "unresolved"})
    with pytest.raises(BadInput, match=r"lugre\.fc is unresolved"):
        learn_model(known(parameters=model.parameters | {"lugre.fc": loose}), TENTH, {"force"})
