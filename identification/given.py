"""What is known of a plant before anything is fitted: values to hold, effects that it lacks, its diaphragm's area."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

from identification.data.experiment import Experiment
from recordings import BadParameter, Recording
from simulator import BASE, CATALOGUE, Catalogue

LEFT_OUT: Mapping[str, Mapping[str, float]] = {"spring": {"spring.K": 0.0}}
"""Effects that a plant may lack, as the values that say so. The constant force F0 stays: weight, offset, drive zero."""


PLANT_CONSTANTS = {"moving_mass_kg": "mass.m"}
"""Items of /plant that are measured constants and are held in a fit, with the parameter each fixes. Spring constant and
preload of a data sheet are nominal values: they are what a fit is to find, and are not held unless given."""


def without_effects(names: Iterable[str]) -> dict[str, float]:
    """Values to hold that stand for effects which the plant lacks. Raises BadParameter for one that every plant has.

    >>> without_effects(["spring"])
    {'spring.K': 0.0}
    """
    held: dict[str, float] = {}
    for name in names:
        if name not in LEFT_OUT:
            raise BadParameter("without", name, "it cannot be left out", f"there are {', '.join(LEFT_OUT)}")
        held |= LEFT_OUT[name]
    return held


def with_area(recordings: Iterable[Recording], area: float | None) -> list[Recording]:
    """The recordings with a diaphragm area [m2], which turns pressure into force; as they are for None.

    Raises BadInput for an area that is not positive.
    """
    if area is None:
        return list(recordings)
    return [replace(r, plant=replace(r.plant, diaphragm_area_m2=area)) for r in recordings]


def free_parameters(held: Mapping[str, float], catalogue: Catalogue = CATALOGUE) -> tuple[str, ...]:
    """Full names of the base model's parameters that a fit is free to choose when some are held.

    >>> free_parameters({"mass.m": 2.0})[:2]
    ('spring.K', 'spring.F0')
    """
    every = (name for effect in BASE for name in catalogue[effect].parameter_names())
    return tuple(name for name in every if name not in held)


def plant_constants(experiments: Sequence[Experiment]) -> dict[str, float]:
    """The parameters that the recordings' plants fix, by full name, SI units."""
    return {
        parameter: float(e.plant[item])
        for e in experiments
        for item, parameter in PLANT_CONSTANTS.items()
        if item in e.plant
    }
