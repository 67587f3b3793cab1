"""Recordings of simulated valves: `bristle simulate` as a call."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from typing import Any

from recordings import Array, BadParameter, Recording
from simulator import BASE, Excitation, Sensors, ValveModel, random_valve
from simulator import simulate as simulate_valve

Truth = Mapping[str, float | Array | str]
"""What a simulated recording hides: parameters by full name, the effects, and the signals without noise."""


def simulate(
    excitation: str = "mixed:40",
    *,
    given: Mapping[str, float] | None = None,
    model: ValveModel | str | os.PathLike[str] | None = None,
    seed: int = 0,
    stroke: float | None = None,
    rate: float = 500.0,
    position_noise: float = 0.0,
    force_noise: float = 0.0,
    position_step: float = 0.0,
    force_step: float = 0.0,
) -> Recording:
    """Simulate a valve that a force moves: a seeded random one, or that of a model, with some values changed.

    `simulator.simulate` returns the truth beside the recording: parameters, and signals without noise.

    Parameters
    ----------
    excitation : str
        Shapes with their seconds: ``step``, ``staircase``, ``sine``, ``mixed``, ``positioner``, as in
        ``"staircase:20,sine:20"``.
    given : mapping, optional
        Parameters to set, by full name, in SI units: ``{"lugre.fc": 120}``.
    model : ValveModel or path, optional
        The valve; without one, a LuGre valve of the seed.
    seed : int, optional
        Of valve, excitation and noise. The same seed gives the same recording.
    stroke : float, optional
        Stroke [m]; that of the valve otherwise.
    rate : float, optional
        Samples a second [Hz].
    position_noise, force_noise : float, optional
        Standard deviations of the sensors' noise [m], [N].
    position_step, force_step : float, optional
        Quantisation steps of the sensors [m], [N].

    Returns
    -------
    Recording
        Signals ``time`` [s], ``force`` [N] and ``position`` [m].

    Raises
    ------
    BadInput
        There is no such shape or parameter, or no such valve can be.

    >>> import bristle as br
    >>> recording = br.simulate("sine:2", given={"lugre.fc": 120}, rate=100, seed=1)
    >>> recording["position"].values.shape
    (201,)
    """
    sensors = sensed(rate, position_noise, force_noise, position_step, force_step)
    return simulated(excitation, given=given, model=model, seed=seed, stroke=stroke, sensors=sensors)[0]


def sensed(rate: float, position_noise: float, force_noise: float, position_step: float, force_step: float) -> Sensors:
    """Sampling and sensors of `simulate`. Raises BadInput for what they cannot be."""
    return Sensors(_positive("rate", rate), position_noise, force_noise, position_step, force_step)


def simulated(
    excitation: str,
    *,
    given: Mapping[str, float] | None,
    model: ValveModel | str | os.PathLike[str] | None,
    seed: int,
    stroke: float | None,
    sensors: Sensors,
) -> tuple[Recording, Truth]:
    """As `simulate`, with the truth beside the recording."""
    known, length = random_valve(seed)
    effects: Sequence[str] = BASE
    if model is not None:
        valve = model if isinstance(model, ValveModel) else ValveModel.read(model)
        known, effects, length = valve.values, valve.effects, float(valve.plant.get("stroke_m", length))
    changed: dict[str, Any] = dict(given or {})
    unknown = sorted(set(changed) - set(known))
    if unknown:
        raise BadParameter("given", unknown[0], "no such parameter", f"there are {', '.join(known)}")
    chosen = length if stroke is None else _positive("stroke", stroke)
    return simulate_valve(
        known | changed, Excitation.parse(excitation), sensors, stroke=chosen, effects=tuple(effects), seed=seed
    )


def _positive(parameter: str, value: float) -> float:
    if not 0 < value < float("inf"):
        raise BadParameter(parameter, f"{value:g}", "it is not a positive number", "give a positive number")
    return value
