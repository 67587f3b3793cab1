"""Everything a fit found, as one value: what goes into `model.json` and into the report."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from identification.data.experiment import Experiment
from identification.estimators.coordinates import parameters
from identification.estimators.fitted import Fit, Outcome
from identification.estimators.least_squares import Normal, minimise
from identification.estimators.output_error.problem import Piece, Problem, ResidualForm, Response
from identification.sparse_regression.crosscheck import Crosscheck
from identification.uncertainty.covariance import Uncertainty
from identification.uncertainty.repeats import Repeats
from recordings import Array, Recording
from simulator import FittedTo, Value, ValveModel

ANCHORED = 1.0
"""Window [s] of the runs that are set back to the data (`anchored_error`)."""
SETTLING = 1.0
"""The initial state of a hold-out recording is estimated from this much of its beginning [s]."""


@dataclass(frozen=True)
class Trajectory:
    """A recording against the model's free run, arrays (n_samples,), NaN in gaps.

    name : of the recording; t [s]; position [m], velocity [m/s] : the smoothed motion; force [N]; measured, simulated :
    position, or force where the motion is imposed, in `unit`; noise : standard deviation of the measured, in `unit`;
    unit : ``m`` or ``N``.
    """

    name: str
    t: Array
    position: Array
    velocity: Array
    force: Array
    measured: Array
    simulated: Array
    noise: float
    unit: str

    @property
    def rmse(self) -> float:
        """Root mean square of measured minus simulated, in `unit`."""
        return float(np.sqrt(np.nanmean((self.measured - self.simulated) ** 2)))

    @property
    def nrmse(self) -> float:
        """rmse over the standard deviation of the measured signal; infinite where that never changes."""
        return _relative(self.rmse, self.measured)


@dataclass(frozen=True, repr=False)
class FitResult:
    """What a fit found. `Identification` says what its fields are, and shows it."""

    fit: Fit
    uncertainty: Uncertainty
    model: ValveModel
    trajectories: tuple[Trajectory, ...]
    holdout: tuple[Trajectory, ...]
    crosscheck: Crosscheck | None
    advice: tuple[str, ...]
    repeats: Repeats | None = None

    @property
    def converged(self) -> bool:
        """Whether the fit came to an end that explains the recordings; `fit.outcome` says what else happened."""
        return self.fit.outcome is Outcome.CONVERGED

    @property
    def values(self) -> dict[str, float]:
        """Parameter values by full name, SI units."""
        return self.model.values

    def write(self, path: str | os.PathLike[str]) -> None:
        """Write the model as `model.json`, all or nothing. Raises BadInput when it cannot be written."""
        self.model.write(path)


def free_runs(fit: Fit, experiments: Sequence[Experiment], fitted: bool) -> tuple[Trajectory, ...]:
    """Free runs of a fitted model on some experiments: from the first sample on, only the recorded input enters.

    fitted : the experiments are those of the fit, whose initial states it knows; on others the initial state of each
    segment is estimated from its first `SETTLING` seconds.
    """
    assert fit.problem is not None
    assert fit.minimum is not None
    setting = replace(fit.minimum.setting, window=np.inf, tuning=np.inf)
    problem = fit.problem if fitted else Problem(fit.kernel, fit.coordinates, experiments)
    resets = not np.isinf(fit.minimum.setting.window)
    unknowns = fit.minimum.unknowns if fitted and not resets else _with_initial_states(fit, problem, setting)
    runs = iter(zip(problem.pieces, problem.responses(unknowns, setting), strict=True))
    unit = "m" if fit.kernel.causality == "force" else "N"
    return tuple(_trajectory(e, [next(runs) for _ in e.segments], unit) for e in experiments)


def anchored_error(fit: Fit, experiments: Sequence[Experiment]) -> float | None:
    """Root mean square error [m] of runs that are set back to the data at rests, once in every `ANCHORED` seconds.

    Over minutes stick-slip forgets its phase, so that a free run of the true model is far off as well; this one is not.
    None where the motion is imposed, and where the model diverges.
    """
    if fit.kernel.causality != "force" or fit.minimum is None:
        return None
    problem = Problem(fit.kernel, fit.coordinates, experiments)
    form = ResidualForm(fit.minimum.setting.h_max, max(ANCHORED, 5 * problem.spacing))
    answers = problem.responses(problem.start(fit.minimum.unknowns[: problem.n_free]), form)
    if any(answer is None for answer in answers):
        return None
    errors = [
        (answer.predicted - piece.segment.y)[piece.segment.seen]
        for answer, piece in zip(answers, problem.pieces, strict=True)
        if answer is not None
    ]
    return float(np.sqrt(np.mean(np.concatenate(errors) ** 2)))


def _trajectory(e: Experiment, runs: Sequence[tuple[Piece, Response | None]], unit: str) -> Trajectory:
    """The runs of the segments of an experiment one after the other, with a NaN between them."""
    parts: dict[str, list[Array]] = {k: [] for k in ("t", "position", "velocity", "force", "measured", "simulated")}
    offset = 0.0
    for piece, response in runs:
        s = piece.segment
        hidden = np.where(s.seen, 1.0, np.nan)
        predicted = np.full(len(s.t), np.nan) if response is None else response.predicted
        measured = (s.y if unit == "m" else s.u) * hidden
        columns = (s.t + offset, s.motion.x, s.motion.v, s.u, measured, predicted)
        for key, column in zip(parts, columns, strict=True):
            parts[key].append(np.append(column, np.nan))
        offset += s.t[-1] + s.dt
    joined = {key: np.concatenate(value)[:-1] for key, value in parts.items()}
    return Trajectory(e.name, noise=e.output_noise, unit=unit, **joined)


def _with_initial_states(fit: Fit, problem: Problem, setting: ResidualForm) -> Array:
    """Unknowns with the fitted parameters and initial states fitted to the beginning of each segment."""
    assert fit.minimum is not None
    theta = fit.minimum.unknowns[: problem.n_free]
    short = [
        e.with_segments(tuple(s.part(0, max(10, int(np.searchsorted(s.t, SETTLING)))) for s in e.segments))
        for e in problem.experiments
    ]
    beginning = Problem(fit.kernel, fit.coordinates, short)
    unknowns, shared = beginning.start(theta), len(theta)

    def evaluate(own: Array) -> Normal | None:
        normal = beginning.evaluate(np.concatenate([theta, own]), setting)
        if normal is None:
            return None
        return Normal(normal.cost, normal.gradient[shared:], normal.matrix[shared:, shared:])

    end = minimise(evaluate, unknowns[shared:], iterations=15)
    return unknowns if end is None else np.concatenate([theta, end.theta])


def valve_model(
    fit: Fit,
    known: Uncertainty,
    recordings: Sequence[Recording],
    experiments: Sequence[Experiment],
    errors: Mapping[str, Sequence[Trajectory]],
    quality: Mapping[str, object],
) -> ValveModel:
    """The model as `model.json` has it."""
    values = {}
    for name, parameter in parameters(fit.kernel).items():
        status = known.status.get(name, "given")
        lower, upper = (x if np.isfinite(x) else None for x in (parameter.lower, parameter.upper))
        values[name] = Value(
            value=fit.values[name], std=known.std.get(name),
            unit=parameter.unit, lower=lower, upper=upper,
            status=status, note=known.note.get(name),
        )  # fmt: skip
    plant: dict[str, float | str] = {}
    for e in experiments:
        plant |= e.plant
    return ValveModel(
        effects=fit.kernel.effects, parameters=values, plant=plant,
        noise={
            "position_m": float(np.mean([e.noise_position for e in experiments])),
            "force_N": float(np.mean([e.noise_force for e in experiments])),
        },
        fitted_to=tuple(
            FittedTo(file=Path(r.label).name, sha256=r.sha256 or "", samples=e.samples)
            for r, e in zip(recordings, experiments, strict=True)
        ),
        error={kind: error_of(runs) for kind, runs in errors.items()},
        quality={
            "outcome": fit.outcome.name.lower(), "causality": fit.kernel.causality, "order": fit.order,
            "residual_over_noise": fit.rms, "condition": known.condition, "robust_over_classic_std": known.inflation,
            **quality,
        },
    )  # fmt: skip


def error_of(runs: Sequence[Trajectory]) -> dict[str, float] | None:
    """Free-run error over several recordings: ``rmse_m`` (``rmse_N`` where the motion is imposed) and ``nrmse``.

    What is not finite is left out: a relative error where nothing moves, all of it where the free run diverges.
    """
    if not runs:
        return None
    error = np.concatenate([r.measured - r.simulated for r in runs])
    measured = np.concatenate([r.measured for r in runs])
    rmse = float(np.sqrt(np.nanmean(error**2)))
    found = {f"rmse_{runs[0].unit}": rmse, "nrmse": _relative(rmse, measured)}
    return {name: value for name, value in found.items() if np.isfinite(value)} or None


def _relative(rmse: float, measured: Array) -> float:
    spread = float(np.nanstd(measured))
    return rmse / spread if spread > 1e-12 * float(np.nanmax(np.abs(measured))) else float("inf")
