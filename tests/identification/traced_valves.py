"""Recordings of a valve with an effect that nobody declares, and what a trace says of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cache

from identification import Trace, trace
from identification.tracing.screen import Score, screen
from recordings import Recording, Signal
from simulator import BASE, CATALOGUE, Excitation, Sensors, random_valve, simulate

SEED, RATE = 3, 250.0
COURSES = ("staircase:14", "sine:14", "multisine:12", "multisine:6")


def recorded(effect: str | None = None, values: Mapping[str, float] | None = None) -> list[Recording]:
    """Two recordings to fit, one to judge and one to report on, of a valve with force noise of 0.1 % of span."""
    valve, stroke = random_valve(SEED)
    effects = tuple(e for e in CATALOGUE.ids if e in (*BASE, effect))
    span = valve["spring.K"] * stroke
    sensors = Sensors(RATE, position_noise=2e-4 * stroke, force_noise=1e-3 * span)
    return [
        simulate(
            {**valve, **(values or {})}, Excitation.parse(course), sensors, stroke=stroke, effects=effects, seed=i
        )[0]
        for i, course in enumerate(COURSES)
    ]


@cache
def traced(effect: str | None, **values: float) -> Trace:
    """A trace of recordings with an effect; the last reports."""
    first, second, held, last = recorded(effect, {f"{effect}.{k}": v for k, v in values.items()})
    return trace([first, second], holdout=[held], report_on=[last])


@cache
def screened(effect: str | None, **values: float) -> Sequence[Score]:
    """The scores of all candidates beside the base model of that trace."""
    return screen(traced(effect, **values).selection.base)


def imposed(recording: Recording) -> Recording:
    """The same recording as one of a rig that imposes the motion and measures the force."""
    roles = {"time": "time", "position": "input", "force": "output"}
    signals = [Signal(name, recording[name].values, recording[name].unit, role) for name, role in roles.items()]
    return Recording.of(signals, plant=recording.plant, source="simulated", title="imposed")


@cache
def traced_imposed(effect: str | None, **values: float) -> Trace:
    """A trace of the same recordings, as those of such a rig."""
    first, second, held, _ = (imposed(r) for r in recorded(effect, {f"{effect}.{k}": v for k, v in values.items()}))
    return trace([first, second], holdout=[held])
