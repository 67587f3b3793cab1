"""The second residual generator as one part: filter and balance of a valve, with what they remember."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from math import nan, sqrt
from typing import Any, NamedTuple

import numpy as np

from detector.measurements import Measurement, Measurements
from detector.watch.force_balance import MEMORY, Balance, BalanceTest, SlidingMoment, forces, sliding
from detector.watch.model.filter import DIRECTIONS, FilterState, ModelFilter
from detector.watch.model.innovations import SKIPPED, evidence_of, innovations
from detector.watch.model.tuning import filter_for, tuned
from recordings import Array, BadInput
from simulator import CATALOGUE, Catalogue, ValveModel

TESTS = (*DIRECTIONS, "energy", "force against motion", "force along stroke")
"""Names of the residuals: four of the innovation, two of the balance of forces."""

_ALONE = len(DIRECTIONS) + 1
"""So many of them are of the innovation."""

_SILENT = np.full(len(TESTS), np.nan)

_FEW = round(MEMORY)

BEYOND = 0.25
"""How far the stem may leave the positions it was learned in, as a share of their range."""


class ModelState(NamedTuple):
    """What is remembered: of the filter and the balance; n_samples : since the start."""

    filter: FilterState
    balance: Balance
    n_samples: int


@dataclass(frozen=True)
class ModelWatch:
    """Filter and balance of one valve. low, high : positions between which the model was learned [m], a quarter of
    their distance more on either side; beyond, on a stop above all, it knows nothing of the forces.
    """

    filter: ModelFilter
    balance: BalanceTest
    low: float
    high: float

    def step(
        self, before: ModelState | None, moment: Measurement, fresh: bool, alarmed: bool, wrong: float = nan
    ) -> tuple[ModelState | None, Array]:
        """One sample, and the residuals of `TESTS`, NaN where they say nothing. fresh : restart the filter here, as
        beyond the learned positions; the evidence for a kind stays; wrong : how far the position is from that of the
        flow [m], NaN where unknown. None until the force is known.
        """
        if not np.isfinite(self.filter.force(moment)):
            return before, _SILENT
        if before is None:
            return ModelState(self.filter.start(moment), self.balance.start(self.filter, moment), 1), _SILENT
        if fresh or not self.low <= moment.values["position"] <= self.high:
            resumed = self.balance.resumed(before.balance, self.filter, moment)
            return ModelState(self.filter.start(moment), resumed, 1), _SILENT
        inner, seen = self.filter.step(before.filter, moment)
        count = min(before.n_samples + 1, SKIPPED + 1)
        balance, slides = self.balance.step(before.balance, self.filter, moment, alarmed, wrong)
        said = _SILENT.copy()
        if count > SKIPPED and not seen.resting:
            away, scale = seen.value / sqrt(seen.variance), sqrt(seen.variance)
            said[: _ALONE - 1], said[_ALONE - 1] = seen.slope / scale * away, away
        if slides is not None:
            said[_ALONE:] = slides.way * slides.left, slides.left
        return ModelState(inner, balance, count), said

    def kind(self, state: ModelState) -> str | None:
        """The direction of change that the balance of forces names."""
        return self.balance.kind(self.filter, state.balance)

    def spring_is_weak(self, state: ModelState) -> bool | None:
        """Whether the spring pushes along the stroke, and not a wrong scale of the force; None while open."""
        return self.balance.spring_is_weak(self.filter, state.balance)

    def position_is_wrong(self, state: ModelState) -> bool | None:
        """Whether the position sensor explains flow and force together; None while that is open."""
        return self.balance.position_is_wrong(self.filter, state.balance)

    def as_dict(self) -> dict[str, Any]:
        """Plain numbers, for JSON."""
        return {
            "filter": self.filter.as_dict(), "balance": asdict(self.balance), "low": self.low, "high": self.high,
        }  # fmt: skip

    @classmethod
    def from_dict(cls, parts: Mapping[str, Any], catalogue: Catalogue = CATALOGUE) -> ModelWatch:
        """What `as_dict` gave. Raises BadInput for an effect that the catalogue does not have."""
        filter = ModelFilter.from_dict(parts["filter"], catalogue)
        return cls(filter, BalanceTest(**parts["balance"]), parts["low"], parts["high"])


def learned_model(
    model: ValveModel, data: Measurements, catalogue: Catalogue = CATALOGUE
) -> tuple[ModelWatch, Array] | None:
    """The watch on fault-free data, with its residuals (n_samples, n_tests); None without force or pressure and area.

    Each half of the data is judged by the filter tuned on the other: on data that it was tuned on a filter looks better
    than it is. Raises BadInput as `filter_for` does, and when the model cannot follow the data.
    """
    filter = filter_for(model, data, catalogue)
    if filter is None:
        return None
    half = len(data) // 2
    first, second = data[:half], data[half:]
    residuals = np.concatenate([_residuals(tuned(filter, second), first), _residuals(tuned(filter, first), second)])
    filter = tuned(filter, data)
    innovation = residuals[:, :_ALONE]
    if np.isinf(innovation).any() or not np.isfinite(innovation).any():
        raise BadInput("model", "it cannot follow the data", "fit it to recordings of this valve")
    x = data.values["position"]
    low, high = np.nanmin(x), np.nanmax(x)
    margin = BEYOND * (high - low)
    balance = BalanceTest(filter.dt_s, filter.smoothing_s, _usual(sliding(filter, data)))
    return ModelWatch(filter, balance, float(low - margin), float(high + margin)), residuals


def _residuals(filter: ModelFilter, data: Measurements) -> Array:
    """The residuals of `TESTS` (n_samples, n_tests), NaN where they say nothing."""
    run = innovations(filter, data)
    found = evidence_of(run.value, run.variance, run.slope)
    found[run.fresh] = np.nan
    return np.hstack([found, forces(sliding(filter, data))])


def _usual(found: Sequence[SlidingMoment | None]) -> float:
    """Mean square of the unexplained force in a few sliding samples in a row, the median of healthy data [N2]."""
    squares = np.array([one.left**2 for one in found if one is not None])
    if len(squares) < _FEW:
        return 0.0
    return float(np.median(np.convolve(squares, np.full(_FEW, 1.0 / _FEW), "valid")))


def model_state_as_dict(state: ModelState) -> dict[str, Any]:
    """Plain numbers and lists, for JSON."""
    return {
        name: {key: _plain(value) for key, value in getattr(state, name)._asdict().items()}
        for name in ("filter", "balance")
    } | {"n_samples": state.n_samples}


def model_state_from_dict(parts: Mapping[str, Any]) -> ModelState:
    """What `model_state_as_dict` gave."""

    def arrays(name: str) -> dict[str, Any]:
        return {key: np.array(v, float) if isinstance(v, list) else float(v) for key, v in parts[name].items()}

    return ModelState(
        FilterState(**arrays("filter")),
        Balance(**arrays("balance")),
        int(parts["n_samples"]),
    )


def _plain(value: Any) -> Any:
    return value.tolist() if isinstance(value, np.ndarray) else float(value)
