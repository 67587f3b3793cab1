"""The second residual generator as one part: filter, tests and balance of a valve, with what they remember."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from detector.measurements import Measurement, Measurements
from detector.watch.change_limits import learned_test
from detector.watch.cusum import ChangeTest, Evidence
from detector.watch.force_balance import Balance, BalanceTest
from detector.watch.model.filter import DIRECTIONS, FilterState, ModelFilter
from detector.watch.model.innovations import SKIPPED
from detector.watch.model.tuning import filter_for, tuned
from recordings import Array, BadInput
from simulator import CATALOGUE, Catalogue, ValveModel

TESTS = (*DIRECTIONS, "energy")
"""Names of the scores."""

BEYOND = 0.25
"""How far the stem may leave the positions it was learned in, as a share of their range."""


class ModelState(NamedTuple):
    """What is remembered: of the filter, the tests and the balance; n_samples : since the start."""

    filter: FilterState
    evidence: Evidence
    balance: Balance
    n_samples: int


@dataclass(frozen=True)
class ModelWatch:
    """Filter, change test and balance of one valve. low, high : positions between which the model was learned [m], a
    quarter of their distance more on either side; beyond, on a stop above all, it knows nothing of the forces.
    """

    filter: ModelFilter
    test: ChangeTest
    balance: BalanceTest
    low: float
    high: float

    def step(self, before: ModelState | None, moment: Measurement, fresh: bool, alarmed: bool) -> ModelState | None:
        """One sample. fresh : restart the filter here, as beyond the learned positions; the evidence for a kind stays.
        None until the force is known.
        """
        if not np.isfinite(self.filter.force(moment)):
            return before
        if before is None:
            start = self.balance.start(self.filter, moment)
            return ModelState(self.filter.start(moment), self.test.start(), start, 1)
        if fresh or not self.low <= moment.values["position"] <= self.high:
            return ModelState(self.filter.start(moment), before.evidence, before.balance, 1)
        inner, seen = self.filter.step(before.filter, moment)
        count = min(before.n_samples + 1, SKIPPED + 1)
        shows = count > SKIPPED and not seen.resting
        evidence = self.test.step(before.evidence, seen) if shows else before.evidence
        return ModelState(inner, evidence, self.balance.step(before.balance, self.filter, moment, alarmed), count)

    def raised(self, factor: float) -> ModelWatch:
        """The same with all limits times a factor."""
        limits = tuple(factor * limit for limit in self.test.limits)
        return replace(self, test=replace(self.test, limits=limits))

    def scores(self, state: ModelState) -> Array:
        """The scores of `TESTS`; above 1 means alarm."""
        return self.test.scores(state.evidence)

    def kind(self, state: ModelState) -> str | None:
        """The direction of change that the balance of forces names."""
        return self.balance.kind(self.filter, state.balance)

    def as_dict(self) -> dict[str, Any]:
        """Plain numbers, for JSON."""
        balance = asdict(self.balance)
        parts = {"filter": self.filter.as_dict(), "test": self.test.as_dict(), "balance": balance}
        return parts | {"low": self.low, "high": self.high}

    @classmethod
    def from_dict(cls, parts: Mapping[str, Any], catalogue: Catalogue = CATALOGUE) -> ModelWatch:
        """What `as_dict` gave. Raises BadInput for an effect that the catalogue does not have."""
        filter, test = ModelFilter.from_dict(parts["filter"], catalogue), ChangeTest.from_dict(parts["test"])
        return cls(filter, test, BalanceTest(**parts["balance"]), parts["low"], parts["high"])


def learned_model(
    model: ValveModel, data: Measurements, per_month: float, catalogue: Catalogue = CATALOGUE
) -> tuple[ModelWatch, Array] | None:
    """The watch on fault-free data, with its scores (n_samples, n_tests); None without force or pressure and area.

    Raises BadInput as `filter_for` does, and when the data do not support the rate.
    """
    filter = filter_for(model, data, catalogue)
    if filter is None:
        return None
    test, scores = learned_test(filter, data, per_month)
    filter = tuned(filter, data)
    if not np.isfinite(scores).all():
        raise BadInput("model", "it cannot follow the data", "fit it to recordings of this valve")
    x = data.values["position"]
    low, high = np.nanmin(x), np.nanmax(x)
    margin = BEYOND * (high - low)
    return ModelWatch(filter, test, _usual(filter, data), float(low - margin), float(high + margin)), scores


def _usual(filter: ModelFilter, data: Measurements) -> BalanceTest:
    """The balance's mean square without a fault."""
    test, state, seen = BalanceTest(filter.dt_s, filter.smoothing_s), None, []
    for moment in data:
        if not np.isfinite(moment.values["position"] + filter.force(moment)):
            continue
        state = test.start(filter, moment) if state is None else test.step(state, filter, moment, False)
        if state.weight > 3.0:
            seen.append(state.energy / state.weight)
    return replace(test, usual=float(np.median(seen)) if seen else 0.0)


def model_state_as_dict(state: ModelState) -> dict[str, Any]:
    """Plain numbers and lists, for JSON."""
    return {
        name: {key: _plain(value) for key, value in getattr(state, name)._asdict().items()}
        for name in ("filter", "evidence", "balance")
    } | {"n_samples": state.n_samples}


def model_state_from_dict(parts: Mapping[str, Any]) -> ModelState:
    """What `model_state_as_dict` gave."""

    def arrays(name: str) -> dict[str, Any]:
        return {key: np.array(v, float) if isinstance(v, list) else float(v) for key, v in parts[name].items()}

    return ModelState(
        FilterState(**arrays("filter")),
        Evidence(**arrays("evidence")),
        Balance(**arrays("balance")),
        int(parts["n_samples"]),
    )


def _plain(value: Any) -> Any:
    return value.tolist() if isinstance(value, np.ndarray) else float(value)
