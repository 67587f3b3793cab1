"""What a fit says about a valve in the terms of its trade: friction in % of span, spring rate, bench set, dead band."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from identification.report.runs import runs
from identification.report.wording.numbers import number, percent
from identification.result import FitResult


@dataclass(frozen=True)
class KeyFigures:
    """Figures derived from the fitted parameters; None where the model or the recordings do not have them.

    travel [m] : the stroke where it is known (`stroke_known`), else the travel recorded; span [N] : change of the
    actuator force over it against the spring, or without a spring the recorded range of the force; friction,
    breakaway, preload [N]; rate [N/m]; share : friction over span [1]; dead_band [m] : 2 fc / K, the lost motion at a
    reversal, with its standard deviation; jump [m] : (fs - fc) / K, after a slow break-away (inertia may double it);
    bench_set [Pa] : pressures at both ends of the travel, from the spring alone; swing [Pa] : 2 fc over the area.
    """

    travel: float
    stroke_known: bool
    span: float
    friction: float | None
    breakaway: float | None
    rate: float | None
    preload: float | None
    area: float | None
    dead_band_std: float | None

    @property
    def share(self) -> float | None:
        """Friction over span."""
        return self.friction / self.span if self.friction is not None and self.span > 0 else None

    @property
    def dead_band(self) -> float | None:
        """2 fc / K [m]."""
        return 2 * self.friction / self.rate if self.friction is not None and self.rate else None

    @property
    def jump(self) -> float | None:
        """(fs - fc) / K [m], None where nothing holds the stem back more at rest than in motion."""
        if self.friction is None or self.breakaway is None or not self.rate or self.breakaway <= self.friction:
            return None
        return (self.breakaway - self.friction) / self.rate

    @property
    def bench_set(self) -> tuple[float, float] | None:
        """Pressures [Pa] that balance the spring at x = 0 and at full stroke; None without an area or a stroke."""
        if not self.area or self.rate is None or self.preload is None or not self.stroke_known:
            return None
        return self.preload / self.area, (self.preload + self.rate * self.travel) / self.area

    @property
    def bench_set_words(self) -> str:
        """The bench set in kPa; empty where there is none."""
        return "" if self.bench_set is None else " to ".join(number(p / 1e3) for p in self.bench_set) + " kPa"

    @property
    def swing(self) -> float | None:
        """Change of actuator pressure [Pa] that reverses the stem: 2 fc / A."""
        return 2 * self.friction / self.area if self.friction is not None and self.area else None

    def of_travel(self, length: float) -> str:
        """A length as a share of the travel, in words."""
        return f"{percent(length / self.travel)} of the {self.travel_words}" if self.travel > 0 else "the stem is still"

    @property
    def span_words(self) -> str:
        """What the span is."""
        if not self.rate:
            return "the recorded range of the actuator force"
        return "the spring force over the stroke" if self.stroke_known else "the spring force over the recorded travel"

    @property
    def travel_words(self) -> str:
        """What the travel is."""
        return "stroke" if self.stroke_known else "recorded travel"


def key_figures(identification: FitResult) -> KeyFigures:
    """The key figures of an identification."""
    model, values = identification.model, identification.model.values
    stroke, area = _constant(identification, "stroke_m"), _constant(identification, "diaphragm_area_m2")
    travel = stroke or max(_range(r.trajectory.position) for r in runs(identification))
    stiff = values.get("spring.K", 0.0) > 0 and model.parameters["spring.K"].status != "at_bound"
    rate = values["spring.K"] if stiff else None
    force = max(_range(r.actuator_force) for r in runs(identification))
    return KeyFigures(
        travel=travel, stroke_known=stroke is not None, span=rate * travel if rate else force,
        friction=values.get("lugre.fc"), breakaway=values.get("lugre.fs"), rate=rate,
        preload=values.get("spring.F0"), area=area, dead_band_std=_dead_band_std(identification) if rate else None,
    )  # fmt: skip


def _constant(identification: FitResult, name: str) -> float | None:
    value = identification.model.plant.get(name)
    return float(value) if isinstance(value, int | float) and value > 0 else None


def _range(values: object) -> float:
    finite = np.asarray(values)[np.isfinite(np.asarray(values))]
    return float(np.ptp(finite)) if len(finite) else 0.0


def _dead_band_std(identification: FitResult) -> float | None:
    """Standard deviation of 2 fc / K [m] to first order, with the correlation of fc and K where both were fitted."""
    model, known = identification.model, identification.uncertainty
    values = model.values
    if "lugre.fc" not in values or values["lugre.fc"] <= 0:
        return None
    fc, K = ((model.parameters[n].std or 0.0) / values[n] for n in ("lugre.fc", "spring.K"))
    correlation = 0.0
    if {"lugre.fc", "spring.K"} <= set(known.names):
        correlation = float(known.correlation[known.names.index("lugre.fc"), known.names.index("spring.K")])
    relative = np.sqrt(max(fc**2 + K**2 - 2 * correlation * fc * K, 0.0))
    return float(2 * values["lugre.fc"] / values["spring.K"] * relative)
