"""A fit compared with a sparse regression that borrows nothing from it.

The regression takes the recording alone: it finds where the stem slides, and describes the force there by spring, mass
and a friction curve of a shape not known. What the fit says of the same quantities is made of the model's force along
the recorded motion, in the same windows, by the same matrix; spring rate and preload of the base model are its own.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from identification.data.experiment import Experiment
from identification.estimators.fitted import Fit
from identification.sparse_regression.regression import SLOPE, Regression, SlidingQuantity, regression
from identification.sparse_regression.sliding import sliding
from identification.uncertainty.covariance import NINETY, Uncertainty
from recordings import Array
from simulator import BASE, Kernel, kernel, shows_imposed

ALLOWED_RATE, ALLOWED_FRICTION = 0.02, 0.08
"""What may lie between two intervals that agree: a share of the spring rate, and of sliding friction for the others.
Real friction differs that much by direction and place. What the library does not describe, friction that follows the
speed late, is below half of it on seeded valves."""
VAGUE = 0.25
"""Half an interval of the regression, as a share of what it is compared with, from which a row decides nothing."""


@dataclass(frozen=True)
class ComparedQuantity:
    """One compared quantity, in `unit`. fitted, fitted_half : what the model's force makes of it, and half the width of
    its 90 % interval; regressed, regressed_half : the same of the measured force; allowed : what may lie between two
    intervals that agree; counts : whether it decides. An interval too wide only informs, and so does the slope of
    friction, which is the difference of levels that decide.
    """

    name: str
    unit: str
    fitted: float
    fitted_half: float
    regressed: float
    regressed_half: float
    allowed: float
    counts: bool

    @property
    def difference(self) -> float:
        """regressed - fitted."""
        return self.regressed - self.fitted

    @property
    def reach(self) -> float:
        """The difference up to which they agree: half of either interval, and what is allowed."""
        return self.fitted_half + self.regressed_half + self.allowed

    @property
    def agrees(self) -> bool:
        """Whether the intervals meet, or nearly."""
        return abs(self.difference) <= self.reach or not self.counts


@dataclass(frozen=True)
class Crosscheck:
    """A fit compared with a sparse regression. rows : the quantities, none where there is too little sliding; kept :
    terms of the library that pysindy kept; unexplained : standard deviation of the regression's residual, as a share of
    the force's; lack : why there are no rows.
    """

    rows: tuple[ComparedQuantity, ...]
    kept: tuple[str, ...] = ()
    unexplained: float = float("nan")
    lack: str = ""

    @property
    def decides(self) -> bool:
        """Whether anything could be compared."""
        return any(row.counts for row in self.rows)

    @property
    def agrees(self) -> bool:
        """Whether no row that counts disagrees."""
        return all(row.agrees for row in self.rows)

    @property
    def sentence(self) -> str:
        """The verdict in words."""
        if not self.decides:
            return f"no cross-check: {self.lack or 'the intervals of the regression are too wide'}"
        if self.agrees:
            left = f"{100 * self.unexplained:.1f} % of the force"
            return f"sparse regression agrees with the fit in steady sliding; it leaves {left} unexplained"
        worst = max((r for r in self.rows if not r.agrees), key=lambda r: abs(r.difference) / r.reach)
        return (
            f"sparse regression disagrees with the fit in steady sliding: {worst.name} is "
            f"{worst.regressed:.4g} ± {worst.regressed_half:.2g} {worst.unit}, and by the fit {worst.fitted:.4g}; "
            "the model may lack an effect, which tracing would name"
        )


def crosscheck(fit: Fit, experiments: Sequence[Experiment], known: Uncertainty | None = None) -> Crosscheck:
    """Compare a fit with a sparse regression of the recorded force.

    experiments : as recorded, the force not smoothed; known : uncertainty of the fit, without which it counts as exact.
    """
    if not fit.outcome.usable:
        return Crosscheck((), lack="the fit has no values")
    catalogue = fit.kernel.catalogue
    outside = [effect for effect in fit.kernel.effects if not shows_imposed(catalogue[effect])]
    if outside:
        return Crosscheck((), lack=f"with {outside[0]} the recorded position or force is not that of the stem")
    valve = kernel(fit.kernel.effects, "motion", catalogue)
    models = [_model_force(valve, fit, e, i) for e in experiments for i in range(len(e.segments))]
    found = regression(sliding(experiments, models))
    if isinstance(found, str):
        return Crosscheck((), lack=found)
    if not np.isfinite(found.windows.model).all():
        return Crosscheck((), lack="the model has no force along the recorded motion")
    return Crosscheck(_rows(found, valve, known, fit), found.kept, found.unexplained)


def _model_force(valve: Kernel, fit: Fit, experiment: Experiment, segment: int) -> Array:
    """The model's force along a recorded motion, and its derivatives: (n_samples, 1 + n_parameters)."""
    s = experiment.segments[segment]
    motion = np.column_stack([s.motion.x, s.motion.crept, s.motion.a, s.load])
    start = valve.start(s.motion.x[0], s.motion.v[0], s.load[0])
    run = valve.run(s.t, motion, valve.vector(fit.values), start, sensitivities=True)
    assert run.jacobian is not None
    return np.column_stack([run.outputs[:, 0], run.jacobian[:, 0, : len(valve.parameters)]])


def _rows(found: Regression, valve: Kernel, known: Uncertainty | None, fit: Fit) -> tuple[ComparedQuantity, ...]:
    model = found.matrix @ found.windows.model
    half = NINETY * _std(model[:, 1:], valve, known, fit.rms)
    own = fit.values if set(fit.kernel.effects) <= set(BASE) else {}  # added forces have a part in rate and preload
    pairs = zip(found.quantities, model[:, 0], half, strict=True)
    return tuple(_row(q, float(own.get(q.name, value)), float(h), found.friction) for q, value, h in pairs)


def _std(by: Array, valve: Kernel, known: Uncertainty | None, rms: float) -> Array:
    """Standard deviations of the fitted quantities from their derivatives by the parameters (n_quantities, n), as the
    noise alone makes them: a fit that misses the data knows its parameters worse, and must not be excused by that.
    """
    if known is None:
        return np.zeros(len(by))
    misfit = max(1.0, rms) * max(1.0, known.inflation)
    std = np.array([known.spread[name] for name in known.names]) / misfit
    free = by[:, [valve.parameters.index(name) for name in known.names]] * std
    return np.asarray(np.sqrt(np.einsum("qi,ij,qj->q", free, known.correlation, free).clip(0.0)))


def _row(q: SlidingQuantity, fitted: float, half: float, friction: float) -> ComparedQuantity:
    """A quantity of the regression beside that of the fit. friction [N] : level of sliding friction."""
    against, allowed = abs(friction) * q.size, ALLOWED_FRICTION
    if q.name == "spring.K":
        against, allowed = max(abs(fitted), abs(q.value), against), ALLOWED_RATE
    counts = q.half < VAGUE * against and q.name != SLOPE
    return ComparedQuantity(q.name, q.unit, fitted, half, q.value, q.half, allowed * against, counts)
