"""The innovation of an identified valve model: a Kalman filter on the LuGre model with its added effects.

The force goes in, the position comes out; what the filter did not expect of the position is the innovation. The filter
is the extended one: each step of the compiled model gives the next state and its derivatives by the state (for the
covariance) and by the parameters. The latter, carried through the filter, say how each direction of change of the
parameters would show in the innovation; Basseville and Nikiforov (1993), section 8.3.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields
from functools import cached_property
from math import sqrt
from typing import Any, NamedTuple

import numpy as np

from detector.measurements import Measurement
from recordings import Array, BadInput
from simulator import CATALOGUE, Catalogue, Kernel, Site, kernel

DIRECTIONS = ("friction", "spring", "offset")
"""Level of the dry friction and force of the spring, as shares of the model's, and a constant force [N]."""

SUBSTEP = 5e-3
"""Longest step of the model [s]: a slow poll is bridged in several."""

RESTING, SLOWER = 4.0, 4.0
"""Noise levels that count as rest, and how much slower the slow means are."""

_RESTING_SPEED = 1e-3
"""What the speed may be at a start [m/s]."""


class FilterState(NamedTuple):
    """What the filter remembers. state (n_states,); covariance (n_states, n_states); slope (n_states, n_directions):
    derivatives of the state by the directions; time_s, force, load : of the last sample; load (n_loads,); means (4,) :
    fast and slow means of position [m], fast and slow of force [N].
    """

    state: Array
    covariance: Array
    slope: Array
    time_s: float
    force: float
    load: Array
    means: Array


class PredictionError(NamedTuple):
    """What one sample says. value [m]; variance [m2]; slope (n_directions,): its derivatives by the directions;
    resting : neither position nor force moves by more than their noise, so that nothing of the valve shows.
    """

    value: float
    variance: float
    slope: Array
    resting: bool = False


@dataclass(frozen=True)
class Load:
    """A force on the stem that goes with a process pressure: [gain + slope (x - x0)] (pressure - usual).

    gain [N/Pa]; slope [N/Pa/m]; usual [Pa]; x0 [m].
    """

    signal: str
    usual: float
    x0: float
    gain: float = 0.0
    slope: float = 0.0

    def shares(self, moment: Measurement) -> tuple[float, float]:
        """What multiplies gain and slope; zeros where the pressure is missing."""
        away = moment.values[self.signal] - self.usual
        if not np.isfinite(away):
            return 0.0, 0.0
        return away, away * (moment.values["position"] - self.x0)


@dataclass(frozen=True)
class ModelFilter:
    """The filter of one valve.

    effects, values : the model; area : of the diaphragm [m2], None when the force itself is measured; position_noise
    [m], force_noise [N] : of the sensors; drift [m] : what the position may do beside the model in one sample;
    loads : forces that go with process pressures; dt_s : sampling time [s]; smoothing_s : time in which a moving stem
    is well ahead of its noise [s]; catalogue : where the effects are looked up.
    Raises BadInput for an effect that the catalogue does not have.
    """

    effects: tuple[str, ...]
    values: Mapping[str, float]
    area: float | None
    position_noise: float
    force_noise: float
    drift: float
    dt_s: float
    smoothing_s: float
    loads: tuple[Load, ...] = ()
    catalogue: Catalogue = CATALOGUE

    def __post_init__(self) -> None:
        for effect in self.effects:
            if effect not in self.catalogue:
                remedy = f"give the catalogue that has it; this one has {', '.join(self.catalogue.ids)}"
                raise BadInput("model", f"there is no effect '{effect}'", remedy, parameter="catalogue")

    def force(self, moment: Measurement) -> float:
        """The force on the stem [N] without the loads."""
        if self.area is None:
            return moment.values["force"]
        return moment.values["pressure"] * self.area

    def net_force(self, moment: Measurement) -> float:
        """The force on the stem less the loads [N]."""
        return self.force(moment) - float(self._shares(moment) @ self._gains)

    def start(self, moment: Measurement) -> FilterState:
        """At rest at a sample, with everything else unknown."""
        load, force = self._shares(moment), self.net_force(moment)
        state = self._kernel.start(moment.values["position"], 0.0, force)
        n = len(state)
        return FilterState(
            state,
            np.diag(self._unsure),
            np.zeros((n, self._ways(load).shape[1])),
            moment.time_s,
            force,
            load,
            np.array([moment.values["position"]] * 2 + [force] * 2),
        )

    def step(self, before: FilterState, moment: Measurement) -> tuple[FilterState, PredictionError]:
        """One sample. The filter restarts where the model has no solution."""
        load, force = self._shares(moment), self.net_force(moment)
        run = self._kernel.run(
            np.array([before.time_s, moment.time_s]), np.array([before.force, force]), self._p, before.state,
            h_max=SUBSTEP, sensitivities=True,
        )  # fmt: skip
        if run.failed is not None or run.final_jacobian is None:
            state = self.start(moment)
            return state, PredictionError(0.0, self.position_noise**2, np.zeros(state.slope.shape[1]))
        n_p = len(self._p)
        by_p, by_state = run.final_jacobian[:, :n_p], run.final_jacobian[:, n_p:]
        pushed = -by_p[:, self._place["spring.F0"]]
        covariance = by_state @ before.covariance @ by_state.T + np.outer(pushed, pushed) * self.force_noise**2
        covariance[0, 0] += self.drift**2
        slope = by_state @ before.slope + by_p @ self._ways(0.5 * (load + before.load))
        after, seen = self._corrected(moment, run.final, covariance, slope, float(run.outputs[1, 0]), force, load)
        means = before.means + self._pace * (np.array([moment.values["position"]] * 2 + [force] * 2) - before.means)
        return after._replace(means=means), seen._replace(resting=self._rests(means))

    def _rests(self, means: Array) -> bool:
        """Whether fast and slow means agree within the noise of the fast ones."""
        left = RESTING * sqrt(min(0.5 * self.dt_s / self.smoothing_s, 1.0))
        position, force = abs(float(means[0] - means[1])), abs(float(means[2] - means[3]))
        return position < left * self.position_noise and force < left * self.force_noise

    def _corrected(
        self, moment: Measurement, state: Array, covariance: Array, slope: Array, expected: float, force: float,
        load: Array,
    ) -> tuple[FilterState, PredictionError]:  # fmt: skip
        """The measurement's part of the step."""
        seen = self._seen(state, moment.time_s, force)
        variance = float(seen @ covariance @ seen) + self.position_noise**2
        gain = covariance @ seen / variance
        value, shows = moment.values["position"] - expected, seen @ slope
        after = FilterState(
            state + gain * value, covariance - np.outer(gain, seen @ covariance), slope - np.outer(gain, shows),
            moment.time_s, force, load, np.zeros(4),
        )  # fmt: skip
        return after, PredictionError(value, variance, shows)

    def as_dict(self) -> dict[str, Any]:
        """Plain numbers, for JSON. The effects are named, and looked up again by `from_dict`."""
        parts = {item.name: getattr(self, item.name) for item in fields(self) if item.name != "catalogue"}
        return parts | {"values": dict(self.values), "loads": tuple(asdict(load) for load in self.loads)}

    @classmethod
    def from_dict(cls, parts: Mapping[str, Any], catalogue: Catalogue = CATALOGUE) -> ModelFilter:
        """What `as_dict` gave. Raises BadInput for an effect that the catalogue does not have."""
        loads = tuple(Load(**load) for load in parts["loads"])
        return cls(**{**parts, "effects": tuple(parts["effects"]), "loads": loads, "catalogue": catalogue})

    @cached_property
    def _kernel(self) -> Kernel:
        return kernel(self.effects, catalogue=self.catalogue)

    @cached_property
    def _p(self) -> Array:
        return self._kernel.vector(self.values)

    @cached_property
    def _place(self) -> dict[str, int]:
        return {name: i for i, name in enumerate(self._kernel.parameters)}

    @cached_property
    def _pace(self) -> Array:
        """How far the means follow in one sample."""
        return 1.0 - np.exp(-self.dt_s / (self.smoothing_s * np.array([1.0, SLOWER, 1.0, SLOWER])))

    @cached_property
    def _gains(self) -> Array:
        return np.array([value for load in self.loads for value in (load.gain, load.slope)])

    def _shares(self, moment: Measurement) -> Array:
        return np.array([value for load in self.loads for value in load.shares(moment)])

    def _ways(self, load: Array) -> Array:
        """Derivatives of the parameters by the directions, (n_parameters, n_directions): those named, then loads."""
        ways = np.zeros((len(self._p), len(DIRECTIONS) + 1 + len(load)))
        ways[:, : len(DIRECTIONS) + 1] = self._fixed
        ways[self._place["spring.F0"], len(DIRECTIONS) + 1 :] = load
        return ways

    @cached_property
    def _fixed(self) -> Array:
        """The columns of `DIRECTIONS`, and one of the spring's stiffness alone."""
        fixed, place = np.zeros((len(self._p), len(DIRECTIONS) + 1)), self._place
        for name in ("lugre.fc", "lugre.fs"):
            fixed[place[name], 0] = self.values[name]
        for name in ("spring.K", "spring.F0"):
            fixed[place[name], 1] = self.values[name]
        fixed[place["spring.F0"], 2] = 1.0
        fixed[place["spring.K"], 3] = max(self.values["spring.K"], 1.0)
        return fixed

    @cached_property
    def _unsure(self) -> Array:
        """Variances of the states at a start."""
        bristle = self.values["lugre.fs"] / self.values["lugre.sigma0"]
        known = {"x": self.position_noise, "v": _RESTING_SPEED, "lugre.z": bristle}
        return np.array([known.get(name, self.position_noise) ** 2 for name in self._kernel.states])

    @cached_property
    def _bent(self) -> bool:
        """Whether an effect stands between the stem and what is measured."""
        return any(self.catalogue[effect].site is Site.OUTPUT for effect in self.effects)

    def _seen(self, state: Array, time_s: float, force: float) -> Array:
        """Derivatives of what is measured by the state."""
        if not self._bent:
            return np.eye(1, len(state))[0]
        run = self._kernel.run(np.array([time_s]), np.array([force]), self._p, state, sensitivities=True)
        return np.zeros(len(state)) if run.jacobian is None else run.jacobian[0, 0, len(self._p) :]
