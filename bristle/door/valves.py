"""Recordings of simulated valves: `bristle simulate` as a call."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping

from recordings import BadParameter, Recording, Truth
from simulator import BASE, CATALOGUE, Catalogue, Excitation, Sensors, ValveModel, random_valve
from simulator import simulate as simulate_valve


def simulate(
    excitation: str = "mixed:40",
    *,
    given: Mapping[str, float] | None = None,
    model: ValveModel | str | os.PathLike[str] | None = None,
    effects: Iterable[str] = (),
    catalogue: Catalogue = CATALOGUE,
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
        Shapes with their seconds, as in ``"staircase:20,sine:20"``: ``step``, ``staircase``, ``ramp``, ``sine``,
        ``multisine``, ``chirp``, ``presliding``, ``mixed``; or ``positioner`` alone.
    given : mapping, optional
        Parameters to set, by full name, in SI units: ``{"lugre.fc": 120}``.
    model : ValveModel or path, optional
        The valve; without one, a LuGre valve of the seed.
    effects : names, optional
        Further effects that the valve has: ``["backlash"]``, of typical size where `given` says no other.
    catalogue : Catalogue, optional
        Where effects are looked up; ``br.CATALOGUE.extended(MyEffect())`` adds your own.
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
        There is no such shape or parameter, or the values cannot be those of a valve.

    >>> import bristle as br
    >>> recording = br.simulate("sine:2", given={"lugre.fc": 120}, rate=100, seed=1)
    >>> recording["position"].values.shape
    (201,)
    """
    sensors = sensed(rate, position_noise, force_noise, position_step, force_step)
    return simulated(
        excitation, given=given, model=model, effects=effects, catalogue=catalogue, seed=seed, stroke=stroke,
        sensors=sensors,
    )[0]  # fmt: skip


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
    effects: Iterable[str] = (),
    catalogue: Catalogue = CATALOGUE,
) -> tuple[Recording, Truth]:
    """As `simulate`, with the truth beside the recording."""
    own, values, length = valve_of(model, seed, catalogue)
    added = [effect for effect in effects if effect not in own]
    unknown = next((effect for effect in added if effect not in catalogue), None)
    if unknown is not None:
        raise BadParameter("effects", unknown, "there is no such effect", f"there are {', '.join(catalogue.ids)}")
    values = {name: one.scale for name, one in catalogue.parameters(added).items()} | values
    wrong = next((name for name in given or {} if name not in values), None)
    if wrong is not None:
        raise BadParameter("given", wrong, "no such parameter", f"there are {', '.join(values)}")
    return simulate_valve(
        values | dict(given or {}), Excitation.parse(excitation), sensors, effects=(*own, *added), seed=seed,
        stroke=length if stroke is None else _positive("stroke", stroke), catalogue=catalogue,
    )  # fmt: skip


def valve_of(
    model: ValveModel | str | os.PathLike[str] | None, seed: int, catalogue: Catalogue = CATALOGUE
) -> tuple[tuple[str, ...], dict[str, float], float]:
    """Effects, parameters by full name, and stroke [m]: of a model, or of the seed."""
    values, stroke = random_valve(seed)
    if model is None:
        return BASE, values, stroke
    valve = model if isinstance(model, ValveModel) else ValveModel.read(model, catalogue)
    return valve.effects, valve.values, float(valve.plant.get("stroke_m", stroke))


def _positive(parameter: str, value: float) -> float:
    if not 0 < value < float("inf"):
        raise BadParameter(parameter, f"{value:g}", "it is not a positive number", "give a positive number")
    return value
