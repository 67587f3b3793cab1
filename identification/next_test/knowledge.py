"""A model of a valve with what is known of its parameters, ready to say what a test would teach."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from scipy.stats import norm, qmc

from identification.estimators.coordinates import Coordinates
from identification.estimators.output_error.problem import MEMORY_STD
from identification.uncertainty.covariance import PRIOR_LOG_STD, WEAK
from recordings import Array, BadInput, IndexArray
from simulator import CATALOGUE, Catalogue, Kernel, ValveModel, kernel

HELD = ("given", "at_bound")
"""Statuses of parameters that a test is not to find."""
UNKNOWN_NOISE = 1e-4
"""Noise of a position where a model does not say it, share of the stroke."""
STARTS = 10.0
"""What is known of where the stem rests at first, in standard deviations of the noise."""
USUAL = 1.5
"""How far the parameters of valves are from their usual size, standard deviation of the logarithm."""
SEED = 26
"""Of the valves that one may be."""
WINDOW = 1.0
"""Time [s] in which the derivatives forget once, where the stem is most at rest."""


@dataclass(frozen=True)
class DrivenTest:
    """A test as the valve gets it. t (n_samples,) [s], force (n_samples,) [N]; hold : the force is held between
    samples; h_max : longest sub-step [s].
    """

    t: Array
    force: Array
    hold: bool
    h_max: float


@dataclass(frozen=True)
class ExpectedPath:
    """What a model expects. y (n_samples,) : position [m]; by (n_samples, n_free + n_starts) : its derivatives by what
    is free and by `own_starts`.
    """

    y: Array
    by: Array


@dataclass(frozen=True)
class KnownValve:
    """A model and what is known of it.

    name : for messages; kernel, coordinates : what is free, and how it is counted; p (n_parameters,); theta (n_free,) :
    the coordinates of p; std (n_free,) : of the coordinates before the test; weak : names of what is weak; noise : of
    the position [m], with what the model leaves unexplained; stroke [m].
    """

    name: str
    kernel: Kernel
    coordinates: Coordinates
    p: Array
    theta: Array
    std: Array
    weak: tuple[str, ...]
    noise: float
    stroke: float
    area: float | None

    @property
    def names(self) -> tuple[str, ...]:
        """The free parameters, by full name."""
        return self.coordinates.free_names

    @property
    def values(self) -> dict[str, float]:
        """All parameters by full name, SI units."""
        return dict(zip(self.kernel.parameters, self.p.tolist(), strict=True))

    @property
    def own_starts(self) -> list[int]:
        """Which of the states at the beginning are not known: the position, and memory that friction leaves."""
        return [0, *(i + 2 for i, memory in enumerate(self.kernel.layout.memory) if memory.free)]

    def supposed(self, number: int) -> tuple[KnownValve, ...]:
        """Valves that this one may be: its weak parameters drawn (Sobol) from what is known of them and from the size
        that they usually have.

        A test that is best for a poor value of a weak parameter may be poor for the true one.
        """
        usual = self.coordinates.theta(self.coordinates.scale)
        drawn = np.array([name in self.weak for name in self.names]) & self.coordinates.logs[self.coordinates.free]
        precision = np.where(drawn, self.std**-2.0 + USUAL**-2.0, self.std**-2.0)
        mean = np.where(drawn, (self.theta / self.std**2 + usual / USUAL**2) / precision, self.theta)
        std = precision**-0.5
        dice = norm.ppf(qmc.Sobol(max(int(drawn.sum()), 1), seed=SEED).random(number))
        found = []
        for row in dice:
            theta = mean.copy()
            theta[drawn] += std[drawn] * row[: int(drawn.sum())]
            p = self.coordinates.p(theta)
            found.append(replace(self, p=p, theta=theta, std=std))
        return tuple(found)

    @property
    def start_std(self) -> Array:
        """What is known of `own_starts`, standard deviations in their units."""
        return np.array([STARTS * self.noise, *[MEMORY_STD] * (len(self.own_starts) - 1)])

    def path(self, test: DrivenTest, p: Array, s0: Array) -> Array | None:
        """The position [m] (n_samples,) for parameters p (n_parameters,) and a first state (n_states,); None where it
        diverges."""
        run = self.kernel.run(test.t, test.force, p, s0, h_max=test.h_max, hold=test.hold)
        return None if run.failed is not None else run.outputs[:, 0]

    def response(self, test: DrivenTest, p: Array, s0: Array) -> ExpectedPath | None:
        """The same with its derivatives, which forget at rests, as those of a fit do that is set back to the recorded
        motion there: over many slips a free run amplifies what no recording repeats.
        """
        y = self.path(test, p, s0)
        if y is None:
            return None
        v = np.gradient(y, test.t)
        given = np.asarray(self.kernel.inputs(test.t, test.force, p, hold=test.hold))
        edges, state = _anchors(test.t, v), s0
        by = np.zeros((len(y), len(self.names) + len(self.own_starts)))
        for first, last in pairwise(edges):
            part = slice(first, last + 1)
            run = self.kernel.run(
                test.t[part], given[part], p, state, h_max=test.h_max, hold=test.hold, sensitivities=True
            )
            if run.failed is not None or run.jacobian is None:
                return None
            columns, state = run.jacobian[:, 0, :], run.final
            by[part, : len(self.names)] = columns[:, : len(p)][:, self.coordinates.free] * self.coordinates.slope(p)
            if first == 0:
                by[part, len(self.names) :] = columns[:, len(p) :][:, self.own_starts]
        return ExpectedPath(y, by)

    def at_rest(self, force: float) -> Array:
        """The state (n_states,) of the stem where a constant force [N] balances the spring."""
        values = self.values
        place = (force - values["spring.F0"]) / values["spring.K"]
        return self.kernel.start(place, force=force)


def known_valve(name: str, model: ValveModel, catalogue: Catalogue = CATALOGUE) -> KnownValve:
    """A model as a test sees it. Raises BadInput for one without a spring, or without a stroke."""
    values = model.values
    if not values.get("spring.K"):
        found, remedy = "it has no spring", "a force moves such a valve into its stops: give a model with a spring"
        raise BadInput(name, found, remedy)
    stroke = float(model.plant.get("stroke_m") or 0.0)
    if stroke <= 0:
        raise BadInput(f"{name}: plant", "the stroke is not known", "give it in metres", parameter="stroke")
    order = model.quality.get("order", "full")
    valve = kernel(model.effects, "force", catalogue, damped=order != "full")
    held = {n: one.value for n, one in model.parameters.items() if one.status in HELD or one.value == 0.0}
    coordinates = Coordinates.of(valve, held, max(abs(values["spring.F0"]), values["spring.K"] * stroke))
    p = valve.vector(values)
    slope = dict(zip(coordinates.free_names, coordinates.slope(p).tolist(), strict=True))
    std = {n: _std(model.parameters[n].std, slope[n]) for n in coordinates.free_names}
    weak = tuple(
        n for n in std if model.parameters[n].status == "weak" or std[n] * abs(slope[n]) > WEAK * abs(values[n])
    )
    area = model.plant.get("diaphragm_area_m2")
    over = max(1.0, float(model.quality.get("residual_over_noise") or 1.0))
    return KnownValve(
        name, valve, coordinates, p, coordinates.theta(p), np.array(list(std.values())), weak,
        over * (model.noise.get("position_m") or UNKNOWN_NOISE * stroke), stroke, None if area is None else float(area),
    )  # fmt: skip


def _std(std: float | None, slope: float) -> float:
    """A standard deviation of a coordinate; what is not known at all gets that of the fit's own weak hold."""
    return PRIOR_LOG_STD if std is None or slope == 0 else float(np.clip(std / abs(slope), 1e-9, PRIOR_LOG_STD))


def _anchors(t: Array, v: Array) -> IndexArray:
    """The ends of a test and, in every window, the sample where the stem is most at rest."""
    edges = np.unique(np.searchsorted(t, np.arange(t[0], t[-1] + WINDOW, WINDOW)))
    inner = [a + int(np.argmin(np.abs(v[a:b]))) for a, b in pairwise(edges[1:])]
    return np.unique([0, *inner, len(t) - 1])
