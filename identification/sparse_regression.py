"""A second opinion from sparse regression: does pysindy find the same coefficients in the measured force?

The measured force is regressed on a library of candidate terms. On its own such a regression is useless for friction,
because the bristle deflection is not measured; so the bristle force is reconstructed from the measured motion with the
*fitted* friction parameters and offered as one term. Its coefficient must then be 1, and spring, mass and viscous
friction must come out as the fit has them (Brunton, Proctor, Kutz, PNAS 113(15), 2016; weak form:
Messenger, Bortz, MMS 19(3), 2021).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identification.data.experiment import Experiment, Segment
from identification.data.smoothing import DEAD_ZONE
from identification.estimators.fitted import Fit
from recordings import Array
from simulator import kernel

GATES = {"spring.K": 0.02, "bristle force": 0.05, "lugre.sigma2": 0.25, "mass.m": 0.30}
"""Relative differences up to which regression and fit agree."""
WINDOW = 0.04
"""Width of the test functions of the weak form [s]."""
BLURRED, SURE_TRAVEL, ENOUGH = 0.01, 3.0, 0.2
"""A bristle force is hard to reconstruct near a reversal, from noisy motion. So only samples are used that are so fast
that a window passes `SURE_TRAVEL` break-away distances, if they are at least the share `ENOUGH` of all, or if the
position noise bends the bristles by more than `BLURRED` of the Coulomb level."""
MOST_ROWS = 20000
TERMS = ("a", "x", "v", "bristle", "bristle_rate")


@dataclass(frozen=True)
class ComparedCoefficient:
    """One compared coefficient. fitted, regressed : its values in `unit`; gate : the relative difference up to which
    they agree; counts : whether it decides (a term whose share of the force is small against the error of the
    regression only informs).
    """

    name: str
    unit: str
    fitted: float
    regressed: float
    gate: float
    counts: bool

    @property
    def difference(self) -> float:
        """(regressed - fitted) / fitted."""
        return (self.regressed - self.fitted) / self.fitted if self.fitted else float("inf")

    @property
    def agrees(self) -> bool:
        """Whether the difference is within the gate."""
        return abs(self.difference) <= self.gate or not self.counts


@dataclass(frozen=True)
class Crosscheck:
    """A fit compared with a sparse regression. rows : the coefficients; kept : the terms of `TERMS` that pysindy kept;
    unexplained : standard deviation of the regression's residual, as a share of the force's.
    """

    rows: tuple[ComparedCoefficient, ...]
    kept: tuple[str, ...]
    unexplained: float

    @property
    def agrees(self) -> bool:
        """Whether every row that counts is within its gate."""
        return all(row.agrees for row in self.rows)

    @property
    def sentence(self) -> str:
        """The verdict in words."""
        if self.agrees:
            left = f"{100 * self.unexplained:.1f} % of the force"
            return f"sparse regression agrees with the fit; it leaves {left} unexplained"
        worst = max((r for r in self.rows if not r.agrees), key=lambda r: abs(r.difference) / r.gate)
        return (
            f"sparse regression disagrees with the fit: {worst.name} differs by {100 * worst.difference:+.0f} % "
            f"(allowed {100 * worst.gate:.0f} %); the model may lack an effect, which tracing would name"
        )


def crosscheck(
    fit: Fit, experiments: Sequence[Experiment], std: Mapping[str, float] | None = None
) -> Crosscheck | None:
    """Compare a fit of the base model with a sparse regression.

    std : standard deviations of the fit by name; a parameter known worse than its gate decides nothing.
    None where there is no LuGre friction to reconstruct, too little sliding to reconstruct it from, or nothing decides.
    """
    if "lugre" not in fit.kernel.effects or not fit.outcome.usable:
        return None
    tables = [_table(s, fit, e) for e in experiments for s in e.segments]
    table, force = (np.concatenate(part) for part in zip(*tables, strict=True))
    if len(force) < 10 * len(TERMS):
        return None
    stride = max(1, len(force) // MOST_ROWS)
    library, force = np.column_stack([table, np.ones(len(table))])[::stride], force[::stride]
    scale = np.std(table, axis=0)
    coefficients, kept = _sparse(table[::stride] / np.where(scale > 0, scale, 1.0), force, float(np.std(force)))
    found = dict(zip(TERMS, coefficients / np.where(scale > 0, scale, 1.0), strict=True))
    spread = {term: abs(c) * size for (term, c), size in zip(found.items(), _own(library), strict=True)}
    offset = np.mean(force - library[:, :-1] @ np.array(list(found.values())))
    error = force - library[:, :-1] @ np.array(list(found.values())) - offset
    unexplained = float(np.std(error) / np.std(force))
    rows = _rows(fit, found, spread, float(np.std(error)), std or {})
    return Crosscheck(rows, kept, unexplained) if any(row.counts for row in rows) else None


def _own(library: Array) -> list[float]:
    """Standard deviation of what each term has for itself, apart from all others; the last column is the constant."""
    sizes = []
    for i in range(library.shape[1] - 1):
        others = np.delete(library, i, axis=1)
        sizes.append(float(np.std(library[:, i] - others @ np.linalg.lstsq(others, library[:, i], rcond=None)[0])))
    return sizes


def _rows(
    fit: Fit, found: Mapping[str, float], spread: Mapping[str, float], error: float, std: Mapping[str, float]
) -> tuple[ComparedCoefficient, ...]:
    values = fit.values
    compared = (
        ("spring.K", "N/m", values.get("spring.K", 0.0), found["x"], spread["x"]),
        ("bristle force", "1", 1.0, found["bristle"], spread["bristle"]),
        ("lugre.sigma2", "N s/m", values["lugre.sigma2"], found["v"], spread["v"]),
        ("mass.m", "kg", values.get("mass.m", 0.0), found["a"], spread["a"]),
    )
    return tuple(
        ComparedCoefficient(
            name, unit, fitted, regressed, GATES[name], _decides(fitted, std.get(name, 0.0), GATES[name], share, error)
        )
        for name, unit, fitted, regressed, share in compared
    )


def _decides(fitted: float, std: float, gate: float, share: float, error: float) -> bool:
    """Whether a coefficient's share of the force stands out of the error, and the fit knows it better than its gate."""
    return bool(fitted > 0 and std < gate * fitted and share > 3 * error)


def _table(segment: Segment, fit: Fit, experiment: Experiment) -> tuple[Array, Array]:
    """Candidate terms (n_samples, n_terms) and the measured force (n_samples,), both at measured samples."""
    m, p, noise = segment.motion, fit.values, experiment.noise_position
    alone = kernel(("lugre",), "motion", fit.kernel.catalogue)
    motion = np.column_stack([m.x, m.crept, m.a, np.zeros_like(m.x)])
    p_bristle = {name: p[name] for name in alone.parameters}
    forces = [
        alone.run(segment.t, motion, alone.vector(p_bristle | changed), alone.start()).outputs[:, 0]
        for changed in ({"lugre.sigma1": 0.0, "lugre.sigma2": 0.0}, {"lugre.sigma2": 0.0})
    ]
    table = np.column_stack([m.a, m.x, m.v, forces[0], forces[1] - forces[0]])
    sure = segment.seen.copy()
    flip = 2 * DEAD_ZONE * noise + p["lugre.fc"] / p["lugre.sigma0"]
    fast = sure & (np.abs(m.v) * WINDOW > SURE_TRAVEL * flip)
    if p["lugre.sigma0"] * noise > BLURRED * p["lugre.fc"] or fast.mean() > ENOUGH:
        sure = fast
    force = np.append(segment.u[:1], 0.5 * (segment.u[1:] + segment.u[:-1])) if experiment.hold else segment.u
    return weak(table, sure, segment.dt), weak(force[:, None], sure, segment.dt)[:, 0]


def weak(table: Array, sure: NDArray[np.bool_], dt: float) -> Array:
    """Means of columns (n_samples, n) over Hann windows that overlap by half: the weak form, in which white noise
    averages out. Windows with a sample that is not sure are left out.
    """
    width = max(4, round(WINDOW / dt)) // 2 * 2
    test = np.hanning(width + 1)
    weight = np.where(sure, 1.0, 0.0)
    whole = np.convolve(weight, test / test.sum(), "valid")[:: width // 2] > 1 - 1e-9
    means = [np.convolve(column, test / test.sum(), "valid")[:: width // 2] for column in table.T]
    return np.column_stack(means)[whole]


def _sparse(table: Array, force: Array, force_std: float) -> tuple[Array, tuple[str, ...]]:
    """Sequentially thresholded least squares of the force on standardised terms; coefficients and names kept."""
    import pysindy as ps

    optimizer = ps.STLSQ(threshold=0.002 * force_std, alpha=1e-9, max_iter=20)
    optimizer.fit(table - table.mean(axis=0), (force - force.mean())[:, None])
    coefficients = np.asarray(optimizer.coef_).ravel()
    return coefficients, tuple(name for name, c in zip(TERMS, coefficients, strict=True) if c != 0.0)
