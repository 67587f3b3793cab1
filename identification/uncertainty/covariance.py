"""How well the parameters are known: covariance, condition, correlations, status and a word on each.

Two covariances are computed and the larger standard deviation is reported: the classic one, from the Jacobian at the
measured size of the residual, and one that is robust to a residual that is not white (White, Econometrica 48, 1980;
clustered by blocks of time), because on real data the residual is mostly what the model lacks.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.stats import norm
from scipy.stats import t as student

from identification.estimators.coordinates import parameters
from identification.estimators.estimate import TUNING, Estimate
from identification.estimators.fitted import Fit, Outcome
from identification.estimators.noise_aware.resolution import RESOLVED_BY_NODES
from identification.estimators.order import (
    RESOLVED,
    RESOLVED_EXACT,
    SEEN,
    USUAL,
    at_rest,
    slip,
    slip_is_over,
    slip_is_seen,
    swing,
    turn,
)
from identification.estimators.output_error.problem import Problem, ResidualForm
from recordings import Array
from simulator import Status

NINETY = float(norm.ppf(0.95))
"""Standard deviations to either side of a value by which nine in ten lie."""
BLOCK = 0.5
"""Length of a block of the robust covariance [s], at least 20 samples."""
PRIOR_LOG_STD = 3.0
"""A coordinate the data say nothing about is given this standard deviation, so that every number is finite."""
WEAK = 0.3
"""Relative standard deviation above which a parameter is weak."""
COLLINEAR = 0.95
"""Correlation above which two parameters are called nearly collinear, in tables, pages and files alike."""
WIDER_DAMPED, WIDER_IN_WINDOWS = 1.5, 2.2
"""Factors on the standard deviations of a noise-aware fit to samples that do not show the course of a slip, whose
largest errors are those of a slip at another time and not of noise, and of a fit in windows. Chosen on the development
seeds of `benchmarks/plant_sampling.py`; the coverage on others is in docs/studies/identification.md. Elsewhere none is
needed."""
BENDS = 2.0
"""Standard deviations of the position's noise by which a bristle has to bend before it breaks away, for its stiffness
and the Stribeck velocity to show where its swing is not resolved: below, a stiffer one with another friction curve fits
as well."""
SLOW, SLOW_FACTOR, SLOW_FACTOR_EXACT = 6e-3, 1.6, 1.3
"""Spacing [s] above which what the force does between samples is guessed, and the factors that this costs where the
force is noisy and where its samples are exact."""
QUICK = ("mass.m", "lugre.fs", "lugre.vs", "lugre.sigma0", "lugre.sigma1")
"""What is known of `QUICK` comes from break-away, where the mass swings on its bristles. When that swing turns by more
than so many radians from sample to sample (`RESOLVED_BY_NODES` where the force is noisy), estimate and interval can
both be wrong, and they are reported as unresolved."""
SLIPPING = ("mass.m", "lugre.vs", "lugre.sigma0", "lugre.sigma2")
"""What is known of these in damped order comes from the course of slips. Where a slip is over before the next sample,
Coulomb friction is not told either: it trades with viscous friction by several percent."""
UNTOLD = 0.3
"""Share by which a mass may be off that shows in no course of a slip; what it is taken for moves the others."""
ENOUGH_FOR_SLIPS = 20.0
"""Samples a second by which slips show at all."""
AT_BOUND = 1e-4
"""A parameter that may be zero and is below this share of its scale is at its bound."""


@dataclass(frozen=True)
class Uncertainty:
    """How well the free parameters of a fit are known.

    names : the free parameters; spread : standard deviation by name, in the unit of the parameter, as the problem at
    the end of the fit has it, whether or not it is to be believed; correlation (n_free, n_free), in the order of
    `names`; condition : of the column-scaled Jacobian; status : ``identified``, ``weak`` (the data do not pin it),
    ``unresolved`` (the sampling does not tell it, or the fit did not converge: no interval is reported) or ``at_bound``
    by name; note : the reason in words, by name, where there is one; inflation : median factor by which the robust
    standard deviations exceed the classic ones.
    """

    names: tuple[str, ...]
    spread: dict[str, float]
    correlation: Array
    condition: float
    status: dict[str, Status]
    note: dict[str, str]
    inflation: float

    @property
    def std(self) -> dict[str, float]:
        """Standard deviation by name of the parameters that have an interval: none is `unresolved`."""
        return {name: self.spread[name] for name in self.names if self.status[name] != "unresolved"}

    def pairs(self, above: float = COLLINEAR) -> list[tuple[str, str, float]]:
        """Pairs of parameters with a correlation of more than `above`, and that correlation, strongest first."""
        n = len(self.names)
        found = [(self.names[i], self.names[j], float(self.correlation[i, j])) for i in range(n) for j in range(i)]
        return sorted((p for p in found if abs(p[2]) > above), key=lambda p: -abs(p[2]))


def uncertainty_of(fit: Fit) -> Uncertainty:
    """Uncertainty of a fit that has values (``fit.outcome.usable``)."""
    assert fit.problem is not None
    assert fit.minimum is not None
    if fit.estimate is not None:
        matrix, classic, robust = _innovation_covariances(fit.problem, fit.estimate)
    else:
        matrix, classic, robust = _covariances(
            fit.problem, fit.minimum.unknowns, fit.minimum.setting, max(fit.rms, 1e-12)
        )
    n = fit.problem.n_free
    names = fit.coordinates.free_names
    spread = np.sqrt(np.maximum(np.diag(classic), np.diag(robust)))[:n]
    slow = fit.kernel.causality == "force" and fit.order == "full" and fit.problem.spacing > SLOW
    slope = fit.coordinates.slope(fit.p)
    if fit.order == "damped" and not slip_is_seen(fit.values, fit.problem.spacing):
        spread = spread * (WIDER_DAMPED if fit.estimate is not None else 1.0)
        spread = np.sqrt(spread**2 + _by_mass(fit, names, classic[:n, :n], slope) ** 2)
    if slow:
        spread = spread * (SLOW_FACTOR_EXACT if fit.estimate is None else SLOW_FACTOR)
    if fit.replicates is not None:
        spread = WIDER_IN_WINDOWS * np.sqrt(spread**2 + widened_rms(fit.replicates.moves) ** 2)
    if fit.systematic is not None:
        spread = np.sqrt(spread**2 + fit.systematic**2)
    diagonal = np.sqrt(np.diag(classic)[:n])
    correlation = classic[:n, :n] / np.outer(diagonal, diagonal)
    scaled = matrix[:n, :n] / np.sqrt(np.outer(np.diag(matrix)[:n], np.diag(matrix)[:n]).clip(1e-300))
    eigen = np.linalg.eigvalsh(scaled)
    std = dict(zip(names, (spread * slope).tolist(), strict=True))
    status, note = status_and_note(fit, names, std, correlation)
    for name in (*at_rest(0.0), "lugre.fc") if fit.order == "static" else ():
        if name in fit.kernel.parameters:
            status[name] = "unresolved"
            note[name] = (
                f"a slip is over within the {fit.problem.spacing:g} s between samples; "
                f"{ENOUGH_FOR_SLIPS:.0f} a second would show it"
            )
    inflation = float(np.median(np.sqrt(np.maximum(np.diag(robust)[:n], 0.0) / np.diag(classic)[:n])))
    return Uncertainty(
        names, std, correlation, float(np.sqrt(eigen[-1] / max(eigen[0], 1e-30))), status, note, inflation
    )


def _by_mass(fit: Fit, names: tuple[str, ...], covariance: Array, slope: Array) -> Array:
    """How far every parameter is off (m,), in coordinates, by a mass that is off by `UNTOLD`; 0 where mass is given.

    covariance (m, m) : of the coordinates; slope (m,) : of the parameters by them.
    """
    if "mass.m" not in names:
        return np.zeros(len(names))
    i = names.index("mass.m")
    return np.asarray(covariance[:, i] / covariance[i, i] * UNTOLD * fit.values["mass.m"] / slope[i], float)


def widened_rms(off: Array) -> Array:
    """Root mean squares (n,) of the errors of some trials (n_trials, n), bias included, widened by Student's t for the
    number of trials.
    """
    trials = len(off)
    return np.asarray(float(student.ppf(0.95, trials) / NINETY) * np.sqrt(np.mean(off**2, axis=0)), float)


def _covariances(problem: Problem, unknowns: Array, setting: ResidualForm, rms: float) -> tuple[Array, Array, Array]:
    """The Gauss-Newton matrix and the classic and robust covariances of all unknowns (Huber, Robust Statistics, 1981,
    section 7.6, for a robust loss).
    """
    size = len(unknowns)
    matrix, meat, blocks, bent, weights = np.zeros((size, size)), np.zeros((size, size)), 0, 0.0, 0.0
    for i, response in enumerate(problem.responses(unknowns, setting, sensitivities=True)):
        if response is None or response.by is None:
            continue
        piece = problem.pieces[i]
        at = np.concatenate(
            [np.arange(problem.n_free), problem.n_free + i * problem.n_local + np.arange(problem.n_local)]
        )
        jacobian = np.where(piece.segment.seen[:, None], response.by / piece.noise, 0.0)
        r = problem.residual(i, response)
        ratio = np.zeros(len(r)) if np.isinf(setting.tuning) else (r / setting.tuning) ** 2
        weight = 1.0 / (1.0 + ratio)
        scores = jacobian * (weight * r)[:, None]
        matrix[np.ix_(at, at)] += (jacobian * weight[:, None]).T @ jacobian
        seen = piece.segment.seen
        bent, weights = bent + float(np.sum(((1 - ratio) * weight**2)[seen])), weights + float(np.sum(weight[seen]))
        length = max(20, round(BLOCK / piece.segment.dt))
        sums = np.add.reduceat(scores, np.arange(0, len(scores), length), axis=0)
        meat[np.ix_(at, at)] += sums.T @ sums
        blocks += len(sums)
    hold = np.full(size, rms**2 / PRIOR_LOG_STD**2)
    curvature = max(bent / max(weights, 1.0), 0.2)  # of the robust loss, against the weights that Gauss-Newton uses
    bread = inverse(curvature * matrix + np.diag(hold))
    few = blocks / max(blocks - problem.n_free, 1)
    classic: Array = np.asarray(rms**2 * bread, float)
    robust: Array = few * bread @ meat @ bread + np.diag(np.diag(bread) ** 2 * hold)
    return matrix, classic, robust


def inverse(matrix: Array) -> Array:
    """The inverse of a positive matrix (n, n) with rows of any size; positive where rounding leaves that singular."""
    size = np.sqrt(np.diag(matrix))
    known, ways = np.linalg.eigh(matrix / np.outer(size, size))
    known = np.maximum(known, len(known) * np.finfo(float).eps * known[-1])
    return np.asarray((ways / known) @ ways.T / np.outer(size, size), float)


def _innovation_covariances(problem: Problem, estimate: Estimate) -> tuple[Array, Array, Array]:
    """The same for the free parameters alone, from the innovations of a noise-aware fit.

    The robust one counts every innovation with the weight that the loss gave it.
    """
    n, meat, blocks = problem.n_free, np.zeros((problem.n_free, problem.n_free)), 0
    for line, piece in zip(estimate.linearised, problem.pieces, strict=True):
        sigma = np.sqrt(np.where(np.isfinite(line.variances), line.variances, 1.0))
        r = line.innovations / sigma
        weight = r / (1.0 + (r / TUNING) ** 2) / sigma
        scores = np.einsum("kc,kcm->km", weight, line.by)
        nodes = max(1, round((len(scores) - 1) / (len(piece.segment.t) - 1)))
        length = nodes * max(20, round(BLOCK / piece.segment.dt))
        sums = np.add.reduceat(scores, np.arange(0, len(scores), length), axis=0)
        meat += sums.T @ sums
        blocks += len(sums)
    hold = np.full(n, PRIOR_LOG_STD**-2)
    bread = inverse(estimate.normal.matrix + np.diag(hold))
    robust = blocks / max(blocks - n, 1) * bread @ meat @ bread + np.diag(np.diag(bread) ** 2 * hold)
    classic = bread * max(estimate.loss, 1.0)
    return estimate.normal.matrix, np.asarray(classic, float), np.asarray(robust, float)


def status_and_note(
    fit: Fit, names: tuple[str, ...], std: dict[str, float], correlation: Array, *, proven: bool = False
) -> tuple[dict[str, Status], dict[str, str]]:
    """Status and note of every free parameter, by name. proven : std does not rest on linearisation."""
    known = parameters(fit.kernel)
    status: dict[str, Status] = {}
    note: dict[str, str] = {}
    scale = dict(zip(fit.kernel.parameters, fit.coordinates.scale, strict=True))
    for i, name in enumerate(names):
        value, parameter = fit.values[name], known[name]
        partner = int(np.argmax(np.abs(correlation[i]) - np.eye(len(names))[i]))
        strength = float(correlation[i, partner])
        size = abs(value) if parameter.lower >= 0 else max(abs(value), 0.05 * scale[name])
        if fit.outcome is not Outcome.CONVERGED:
            status[name], note[name] = "unresolved", "the fit did not converge"
        elif value <= parameter.lower + AT_BOUND * scale[name] or value >= parameter.upper - AT_BOUND * scale[name]:
            status[name] = "at_bound"
        elif why := _too_quick(fit, name) or ("" if proven else _unresolved(fit, name, std[name] > WEAK * size)):
            status[name], note[name] = "unresolved", why
        elif std[name] > WEAK * size:
            status[name] = "weak"
            if abs(strength) > COLLINEAR:
                note[name] = f"nearly collinear with {names[partner]} (correlation {strength:+.3f})"
        else:
            status[name] = "identified"
    return status, note


def _hidden(fit: Fit) -> tuple[str, ...]:
    """What a fit of damped order does not tell, however narrow its valley is."""
    assert fit.problem is not None
    noise = max(piece.noise for piece in fit.problem.pieces)
    stiff = fit.values["lugre.fs"] < BENDS * noise * fit.values["lugre.sigma0"]
    return ("lugre.sigma1", "lugre.sigma0", "lugre.vs") if stiff else ("lugre.sigma1",)


def rate_that_shows(fit: Fit, name: str) -> float:
    """Samples a second from which a parameter shows that the sampling of a fit does not tell."""
    if fit.order == "static":
        return ENOUGH_FOR_SLIPS
    if _slips_unseen(fit, name):
        return float(np.ceil(slip(_slipping(fit)) / SEEN / 10) * 10)
    return float(np.ceil(swing(fit.values) / RESOLVED / 100) * 100)


def _slips_unseen(fit: Fit, name: str) -> bool:
    """Whether a parameter shows in the course of slips, and these are jumps between two samples."""
    if fit.order == "full" or fit.problem is None:
        return False
    if name == "lugre.fc":
        return slip_is_over(_slipping(fit), fit.problem.spacing)
    return name in SLIPPING and not slip_is_seen(_slipping(fit), fit.problem.spacing)


def _slipping(fit: Fit) -> dict[str, float]:
    """The values, by full name, that say how long a slip lasts. Where it is a jump between two samples, runs in windows
    do not tell the mass: one that comes out too heavy is no reason to believe that slips show.
    """
    values = fit.values
    told = fit.estimate is not None or fit.coordinates.held("mass.m") is not None
    return values if told else values | {"mass.m": min(values["mass.m"], USUAL)}


def _too_quick(fit: Fit, name: str) -> str:
    """Why a fit of damped order does not tell a parameter, where a slip is a jump between two samples; empty when it
    does. No replicate shows it: what a controller makes of the force meanwhile is unknown.
    """
    if fit.problem is None or not _slips_unseen(fit, name):
        return ""
    return (
        f"a slip takes about {1000 * np.pi / slip(_slipping(fit)):.0f} ms, too quick for {1 / fit.problem.spacing:.0f} "
        f"samples a second; {rate_that_shows(fit, name):.0f} would show it"
    )


def _unresolved(fit: Fit, name: str, wide: bool) -> str:
    """Why the sampling does not tell a parameter: it shows in a swing of the mass on its bristles that the samples do
    not follow; empty when it does. wide : whether the interval is.
    """
    if fit.problem is None or fit.kernel.causality != "force":
        return ""
    spacing = fit.problem.spacing
    limit = RESOLVED_EXACT if fit.estimate is None else RESOLVED_BY_NODES
    hidden = wide or name in _hidden(fit) if fit.order != "full" else name in QUICK
    if not hidden or (fit.order == "full" and turn(fit.values, spacing) < limit):
        return ""
    frequency, rate = swing(fit.values) / (2 * np.pi), 1 / spacing
    return (
        f"the mass swings on its bristles at about {frequency:.0f} Hz, too fast for {rate:.0f} samples a second; "
        f"{rate_that_shows(fit, name):.0f} would show it"
    )
