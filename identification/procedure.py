"""The main job in one call: recordings in, an identified valve with its quality out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Literal

from identification.advice import advice
from identification.budget import Budget
from identification.data.close_motion import closely_imposed
from identification.data.experiment import Experiment, experiment
from identification.data.grid import with_smooth_force
from identification.data.uses import check_used_once
from identification.estimators.fit import Estimator, fit
from identification.estimators.fitted import Fit
from identification.estimators.fitted import held as held_by
from identification.estimators.order import Order
from identification.given import plant_constants
from identification.identified import Identification
from identification.result import anchored_error, free_runs, valve_model
from identification.sparse_regression.crosscheck import crosscheck
from identification.uncertainty.bootstrap import bootstrap_of, checked_trials, with_bootstrap
from identification.uncertainty.covariance import uncertainty_of
from identification.uncertainty.repeats import check_repeats, repeats_of
from recordings import NegativeAnswer, Progress, Recording, silent
from simulator import BASE, CATALOGUE, Catalogue, Causality


def identify(
    recordings: Sequence[Recording],
    *,
    holdout: Sequence[Recording] = (),
    effects: tuple[str, ...] = BASE,
    given: Mapping[str, float] | None = None,
    causality: Causality | None = None,
    hold: bool = False,
    check: bool = True,
    estimator: Estimator = "auto",
    order: Order | Literal["auto"] = "auto",
    priors: Mapping[str, tuple[float, float]] | None = None,
    constraints: Sequence[str] = (),
    bootstrap: int = 0,
    repeats: bool = False,
    budget: float = float("inf"),
    catalogue: Catalogue = CATALOGUE,
    progress: Progress = silent,
) -> Identification:
    """Fit a valve to recordings, say how well its parameters are known, and judge it by free runs.

    Where the noise of the force is accounted for, free runs are made on the smoothed force. The cross-check takes the
    recorded one.

    Parameters
    ----------
    recordings : sequence of Recording
        Fitted together; each with a position and a force, or a pressure and the diaphragm area.
    holdout : sequence of Recording
        Recordings that only judge the fit.
    effects : tuple of str
        Identifiers of the effects that make the model, those of `BASE` among them.
    given : mapping, optional
        Parameters that are held, by full name, SI units. They go before what the recordings say of the plant.
    causality : {"force", "motion"}, optional
        What drives the valve; by default the roles of the signals say it.
    hold : bool
        The force is held between samples (a converter's output) instead of changing linearly.
    check : bool
        Also cross-check with sparse regression.
    estimator : {"auto", "output-error", "noise-aware"}
        As in `fit`.
    order : {"auto", "full", "damped", "static"}
        As in `fit`.
    priors : mapping, optional
        As in `fit`.
    constraints : sequence of str
        As in `fit`.
    bootstrap : int
        Trials of a parametric bootstrap, at least 5; 0 for intervals from the linearised model.
    repeats : bool
        The recordings, two or more, repeat one test: each is also fitted alone, in the same order, with the same held
        values, priors and constraints and the estimator that was asked for: ``auto`` chooses for each of them, and
        ``quality.repeats`` says which. `Identification.repeats` and ``quality.repeats`` of the model have the standard
        deviations between these fits, in the units of the parameters.
    budget : float
        Seconds that the fit may take. When they are over its outcome is `Outcome.OUT_OF_TIME`, without a bootstrap, and
        repeats that are not fitted do not count.
    catalogue : Catalogue
        Where the effects are looked up: ``CATALOGUE.extended(MyEffect())`` for one of your own.
    progress : callable
        Told the stages: the search of the fit, its uncertainty, the bootstrap's trials, repeats, free runs and
        cross-check.

    Raises
    ------
    BadInput
        For recordings that cannot be used; BadParameter for a parameter that cannot, as repeats of one recording.
    NegativeAnswer
        With the outcome's sentence, when no values came out.
    """
    trials = checked_trials(bootstrap)
    if repeats:
        check_repeats(len(recordings))
    check_used_once(recordings, holdout)
    experiments = recorded = [experiment(r, causality, hold=hold) for r in recordings]
    held = plant_constants(experiments) | dict(given or {})
    time = Budget(budget)
    with time.in_force():
        found = fit(
            experiments, effects=effects, given=held, estimator=estimator, catalogue=catalogue, order=order,
            priors=priors, constraints=constraints, progress=progress,
        )  # fmt: skip
    if not found.outcome.usable:
        raise NegativeAnswer(found.outcome.value)
    progress("uncertainty", 0, 0)
    known = uncertainty_of(found)
    scatter = bootstrap_of(found, trials, progress=progress) if trials and not time.over else None
    known = known if scatter is None else with_bootstrap(found, known, scatter)

    def alone(e: Experiment) -> Fit:
        return fit(
            [e], effects=effects, given=held_by(found), estimator=estimator, catalogue=catalogue, order=found.order,
            priors=priors, constraints=constraints,
        )  # fmt: skip

    repeated = repeats_of(found, experiments, alone, time, progress) if repeats else None
    if found.smooths_force and found.problem is not None:
        experiments = list(found.problem.experiments)
    progress("free runs", 0, 0)
    runs = free_runs(found, experiments, fitted=True)
    others = [experiment(r, causality, hold=hold) for r in holdout]
    if others:
        progress("free runs of the recordings held out", 0, 0)
    others = with_smooth_force(others) if found.smooths_force else others
    others = [closely_imposed(e) for e in others] if found.kernel.causality == "motion" else others
    held_out = free_runs(found, others, fitted=False) if others else ()
    if check:
        progress("cross-check", 0, 0)
    checked = crosscheck(found, recorded, known) if check else None
    told = advice(known, found)
    quality: dict[str, object] = {
        "estimator": found.estimator,
        "anchored_rmse_m": {
            "fit": anchored_error(found, experiments),
            "holdout": anchored_error(found, others) if others else None,
        },
        "correlated": [f"{a}, {b}: {c:+.3f}" for a, b, c in known.pairs()],
        "advice": list(told),
        "crosscheck": None if checked is None else checked.sentence,
        "bootstrap": None if scatter is None else {"trials": scatter.trials, "failed": scatter.failed},
        "repeats": None if repeated is None else repeated.as_json(),
    }
    model = valve_model(found, known, recordings, experiments, {"fit": runs, "holdout": held_out}, quality)
    return Identification(found, known, model, runs, held_out, checked, told, repeated)
