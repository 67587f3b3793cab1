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
from math import exp, sqrt
from typing import Any, NamedTuple

import numpy as np

from detector.arithmetic.native import native
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

_SHORT_S = 1e-5
"""So soon after a start the speed still is the acceleration times the time."""


class FilterState(NamedTuple):
    """What the filter remembers. state (n_states,); covariance (n_states, n_states); slope (n_states, n_directions):
    derivatives of the state by the directions; time_s, force : of the last sample; means (4,) : fast and slow means of
    position [m], fast and slow of force [N].
    """

    state: Array
    covariance: Array
    slope: Array
    time_s: float
    force: float
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
        return self.force(moment) - float(self.shares(moment) @ self._gains)

    def unexplained(self, moment: Measurement) -> float:
        """Force on the stem less loads, spring and what else holds it [N]: the friction, if all is well."""
        return self.net_force(moment) - self._held(moment.values["position"])

    def dry_friction(self, speed: float) -> float:
        """At a speed [m/s], in N: a fit may tell it at the speeds of its data alone, and not where it ends."""
        values = self.values
        near = exp(-((speed / values["lugre.vs"]) ** 2))
        return values["lugre.fc"] + (values["lugre.fs"] - values["lugre.fc"]) * near

    def start(self, moment: Measurement) -> FilterState:
        """At rest at a sample, with everything else unknown."""
        force, x = self.net_force(moment), moment.values["position"]
        state = self._kernel.start(x, 0.0, force)
        slope = np.zeros((len(state), len(DIRECTIONS)))
        means = np.array([x, x, force, force])
        return FilterState(state, np.diag(self._unsure), slope, moment.time_s, force, means)

    def step(self, before: FilterState, moment: Measurement) -> tuple[FilterState, PredictionError]:
        """One sample. The filter restarts where the model has no solution."""
        force = self.net_force(moment)
        run = self._kernel.run(
            np.array([before.time_s, moment.time_s]), np.array([before.force, force]), self._p, before.state,
            h_max=SUBSTEP, sensitivities=True,
        )  # fmt: skip
        if run.failed is not None or run.final_jacobian is None:
            state = self.start(moment)
            return state, PredictionError(0.0, self.position_noise**2, np.zeros(state.slope.shape[1]))
        position = moment.values["position"]
        value = position - float(run.outputs[1, 0])
        covariance, slope = _predicted(
            run.final_jacobian, before.covariance, before.slope, self._fixed, self._place["spring.F0"],
            self.force_noise, self.drift,
        )  # fmt: skip
        seen = self._seen(run.final, moment.time_s, force)
        variance, shows = _corrected(run.final, covariance, slope, seen, value, self.position_noise)
        means = _followed(before.means, self._pace, position, force)
        after = FilterState(run.final, covariance, slope, moment.time_s, force, means)
        return after, PredictionError(value, variance, shows, self._rests(means))

    def _rests(self, means: Array) -> bool:
        """Whether fast and slow means agree within the noise of the fast ones."""
        fast_x, slow_x, fast_f, slow_f = means.tolist()
        left = self._left
        return abs(fast_x - slow_x) < left * self.position_noise and abs(fast_f - slow_f) < left * self.force_noise

    @cached_property
    def _left(self) -> float:
        """How far the means of a resting valve are apart, in units of its noise."""
        return RESTING * sqrt(min(0.5 * self.dt_s / self.smoothing_s, 1.0))

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

    def shares(self, moment: Measurement) -> Array:
        """What multiplies gain and slope of each load, (2 n_loads,)."""
        return np.array([value for load in self.loads for value in load.shares(moment)])

    @cached_property
    def _fixed(self) -> Array:
        """Derivatives of the parameters by the directions (n_parameters, n_directions)."""
        fixed, place = np.zeros((len(self._p), len(DIRECTIONS))), self._place
        for name in ("lugre.fc", "lugre.fs"):
            fixed[place[name], 0] = self.values[name]
        for name in ("spring.K", "spring.F0"):
            fixed[place[name], 1] = self.values[name]
        fixed[place["spring.F0"], 2] = 1.0
        return fixed

    def _held(self, position: float) -> float:
        """What a force has to be to hold the stem at a position without friction [N]; where there are effects beside
        spring and friction, by the acceleration that they leave.
        """
        held = self.values["spring.K"] * position + self.values["spring.F0"]
        if not self._more:
            return held
        start = self._kernel.start(position, 0.0, held)
        run = self._kernel.run(np.array([0.0, _SHORT_S]), np.array([held, held]), self._p, start, h_max=_SHORT_S)
        return held if run.failed is not None else held - self.values["mass.m"] * float(run.final[1]) / _SHORT_S

    @cached_property
    def _more(self) -> bool:
        """Whether an effect beside inertia, spring and friction acts on the stem."""
        others = set(self.effects) - {"inertia", "spring", "lugre"}
        return any(self.catalogue[effect].site is not Site.OUTPUT for effect in others)

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

    @cached_property
    def _stem(self) -> Array:
        return np.eye(1, len(self._kernel.states))[0]

    def _seen(self, state: Array, time_s: float, force: float) -> Array:
        """Derivatives of what is measured by the state."""
        if not self._bent:
            return self._stem
        run = self._kernel.run(np.array([time_s]), np.array([force]), self._p, state, sensitivities=True)
        return np.zeros(len(state)) if run.jacobian is None else run.jacobian[0, 0, len(self._p) :]


@native
def _predicted(
    by: Array, covariance: Array, slope: Array, fixed: Array, pushed: int, force_noise: float, drift: float
) -> tuple[Array, Array]:
    """Covariance and slope of the state after a step, whose derivatives `by` are (n_states, n_parameters + n_states).

    fixed (n_parameters, n_directions): derivatives of the parameters by the directions; the noise of the force acts
    through the parameter `pushed`, a constant force.
    """
    n, ways = covariance.shape[0], fixed.shape[1]
    first = by.shape[1] - n
    half, after, moved = np.zeros((n, n)), np.empty((n, n)), np.zeros(slope.shape)
    for i in range(n):
        for k in range(n):
            for j in range(n):
                half[i, j] += by[i, first + k] * covariance[k, j]
            for j in range(slope.shape[1]):
                moved[i, j] += by[i, first + k] * slope[k, j]
        for k in range(first):
            for j in range(ways):
                moved[i, j] += by[i, k] * fixed[k, j]
    for i in range(n):
        for j in range(n):
            value = by[i, pushed] * by[j, pushed] * force_noise**2
            for k in range(n):
                value += half[i, k] * by[j, first + k]
            after[i, j] = value
    after[0, 0] += drift**2
    return after, moved


@native
def _corrected(
    state: Array, covariance: Array, slope: Array, seen: Array, value: float, noise: float
) -> tuple[float, Array]:
    """Takes a measurement that is off by a value into state, covariance and slope; its variance and slope.

    seen (n_states,): derivatives of what is measured by the state.
    """
    n = state.shape[0]
    along, shows = np.zeros(n), np.zeros(slope.shape[1])
    across, variance = np.zeros(n), noise**2
    for k in range(n):
        for j in range(n):
            along[j] += seen[k] * covariance[k, j]
            across[j] += covariance[j, k] * seen[k]
        for j in range(slope.shape[1]):
            shows[j] += seen[k] * slope[k, j]
    for k in range(n):
        variance += along[k] * seen[k]
    for i in range(n):
        gain = across[i] / variance
        state[i] += gain * value
        for j in range(n):
            covariance[i, j] -= gain * along[j]
        for j in range(slope.shape[1]):
            slope[i, j] -= gain * shows[j]
    return variance, shows


@native
def _followed(means: Array, pace: Array, position: float, force: float) -> Array:
    """The fast and slow means of position and force after a sample."""
    after = np.empty(4)
    for i in range(4):
        after[i] = means[i] + pace[i] * ((position if i < 2 else force) - means[i])
    return after
