"""The movements of one valve, gathered in service: counted at once, and looked at a window at a time."""

from __future__ import annotations

import math
import time
from collections.abc import Mapping
from datetime import UTC, datetime
from typing import Annotated, Protocol

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from detector import Measurement
from hil.service.in_service.figures import InServiceFigures, SignatureCurve
from hil.service.in_service.travel import LENGTHS, PLACES, Travel
from hil.service.in_service.trend import MOST, FigureValue, trended, with_value
from hil.service.in_service.window import QUANTITIES, SIGNALS, WindowResult, looked_at
from recordings import Array, Plant, SignalSpec

WINDOW = 6_000
"""Samples of a window at most: 10 min at 10 Hz, 1 min at 100 Hz; 0.3 MB."""

Count = Annotated[float, Field(ge=0.0, le=1e15)]
Bounded = Annotated[float, Field(ge=-1e15, le=1e15)]


_Four = tuple[float, float, float, float]


class KeptMovements(BaseModel):
    """What of the movements outlives the service."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    observed_s: Count = 0.0
    travelled: Count = 0.0
    reversals: Annotated[int, Field(ge=0)] = 0
    steps: Annotated[int, Field(ge=0)] = 0
    places_s: Annotated[list[Count], Field(min_length=len(PLACES) - 1, max_length=len(PLACES) - 1)]
    lengths: Annotated[list[Count], Field(min_length=len(LENGTHS) - 1, max_length=len(LENGTHS) - 1)]
    history: dict[str, Annotated[list[tuple[Bounded, Bounded, Bounded, Bounded]], Field(max_length=MOST)]] = {}


class MovedValve(Protocol):
    """What is asked of a valve's plan."""

    @property
    def signals(self) -> tuple[SignalSpec, ...]: ...

    def known(self, name: str) -> float | None: ...


class Movements:
    """What a valve's movements say. `add` is called for every sample, `figures` seldom, from another thread.

    valve : with its signals, and its stroke where the model knows it.
    """

    def __init__(self, valve: MovedValve) -> None:
        self._stroke = valve.known("stroke_m")
        area = valve.known("diaphragm_area_m2")
        self._plant = Plant(stroke_m=self._stroke, diaphragm_area_m2=area)
        self._present = [name for name in SIGNALS if name in {spec.name for spec in valve.signals}]
        self._rows = np.full((WINDOW, 1 + len(SIGNALS)), np.nan)
        self._n, self._steps = 0, 0
        self._travel = Travel()
        self._history: dict[str, tuple[FigureValue, ...]] = {}
        self._friction_unit = "N"
        self._curve: SignatureCurve | None = None
        self._notes: tuple[str, ...] = ()

    def add(self, measured: Measurement) -> None:
        """One sample."""
        position = measured.values["position"]
        if self._stroke and math.isfinite(position):
            self._travel.add(measured.time_s, 100.0 * position / self._stroke)
        if self._n < WINDOW:
            self._rows[self._n] = (measured.time_s, *[measured.values.get(name, math.nan) for name in SIGNALS])
            self._n += 1

    @property
    def full(self) -> bool:
        """Whether the window has no more room."""
        return self._n >= WINDOW

    def window(self) -> Array:
        """The window so far; a new one begins."""
        rows, self._n = self._rows[: self._n].copy(), 0
        return rows

    def figures(self, rows: Array, at: float | None = None) -> InServiceFigures:
        """Look at a window, and give all figures. at : POSIX [s], now otherwise. It takes a second at most."""
        when = time.time() if at is None else at
        if self._stroke is None:
            self._notes = ("the model does not know the stroke: plant.stroke_m",)
        elif len(rows) >= 2:
            self._learn(looked_at(rows, self._present, self._plant), when)
        places, lengths = self._travel.histograms
        known = {
            name: trended(self._history.get(name, ()), self._friction_unit if name == "friction" else unit)
            for name, unit in QUANTITIES.items()
        }
        return InServiceFigures(
            datetime.fromtimestamp(when, UTC), self._travel.observed_s, places, lengths, self._travel.whole / 100.0,
            self._travel.reversals, self._curve, **known, steps=self._steps, notes=self._notes,
        )  # fmt: skip

    def _learn(self, result: WindowResult, at: float) -> None:
        for name, found in result.values.items():
            seen = FigureValue(at, found.value, found.lower, found.upper)
            self._history[name] = with_value(self._history.get(name, ()), seen)
        self._steps += result.steps
        self._friction_unit, self._notes = result.friction_unit, result.notes
        self._curve = result.curve or self._curve

    def kept(self) -> KeptMovements:
        """What outlives the service."""
        travel = self._travel
        return KeptMovements(
            observed_s=travel.observed_s, travelled=travel.whole, reversals=travel.reversals, steps=self._steps,
            places_s=list(travel.places_s), lengths=list(travel.lengths),
            history={name: list[_Four](seen) for name, seen in self._history.items()},
        )  # fmt: skip

    def resume(self, kept: KeptMovements) -> None:
        """Go on with what an earlier service kept."""
        travel = self._travel
        travel.observed_s, travel.whole, travel.reversals = kept.observed_s, kept.travelled, kept.reversals
        travel.places_s, travel.lengths, self._steps = list(kept.places_s), list(kept.lengths), kept.steps
        self._history = _histories(kept.history)


def _histories(kept: Mapping[str, list[tuple[float, float, float, float]]]) -> dict[str, tuple[FigureValue, ...]]:
    return {name: tuple(FigureValue(*one) for one in seen) for name, seen in kept.items() if name in QUANTITIES}
