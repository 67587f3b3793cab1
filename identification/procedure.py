"""The main job in one call: recordings in, an identified valve with its quality out."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from identification.advice import advice
from identification.data.experiment import Experiment, experiment
from identification.estimators.fit import Estimator, Fit, fit
from identification.estimators.noise_aware.force_noise import with_smooth_force
from identification.result import Identification, free_runs, valve_model
from identification.sparse_regression import crosscheck
from identification.uncertainty.bootstrap import bootstrap, checked_trials, with_bootstrap
from identification.uncertainty.covariance import uncertainty
from recordings import NegativeAnswer, Recording
from simulator import BASE, Causality

PLANT_CONSTANTS = {"moving_mass_kg": "mass.m"}
"""Items of /plant that are measured constants and are held in a fit, with the parameter each fixes. Spring constant and
preload of a data sheet are nominal values: they are what a fit is to find, and are not held unless given."""


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
    trials: int = 0,
    progress: Callable[[], None] = lambda: None,
) -> Identification:
    """Fit, judge and cross-check. Raises BadInput for recordings that cannot be used and NegativeAnswer, with the
    outcome's sentence, when no values came out.

    given : parameters held, by full name, SI units; it goes before what the recordings say of the plant;
    hold : the force is held between samples; check : also run the sparse-regression cross-check; estimator : as in
    `fit`; trials : of a parametric bootstrap, 0 for none, with `progress` called after each. Where the noise of the
    force is accounted for, free runs and cross-check are made on the smoothed force.
    """
    trials = checked_trials(trials)
    experiments = [experiment(r, causality, hold=hold) for r in recordings]
    held = plant_constants(experiments) | dict(given or {})
    found: Fit = fit(experiments, effects=effects, given=held, estimator=estimator)
    if not found.outcome.usable:
        raise NegativeAnswer(found.outcome.value)
    known = uncertainty(found)
    scatter = bootstrap(found, trials, progress=progress) if trials else None
    known = known if scatter is None else with_bootstrap(found, known, scatter)
    smooth = found.estimate is not None
    if smooth and found.problem is not None:
        experiments = list(found.problem.experiments)
    runs = free_runs(found, experiments, fitted=True)
    others = [experiment(r, causality, hold=hold) for r in holdout]
    others = with_smooth_force(others) if smooth else others
    held_out = free_runs(found, others, fitted=False) if others else ()
    checked = crosscheck(found, experiments, known.std) if check else None
    quality: dict[str, object] = {
        "estimator": found.estimator,
        "correlated": [f"{a}, {b}: {c:+.3f}" for a, b, c in known.pairs()],
        "advice": list(advice(known)),
        "crosscheck": None if checked is None else checked.sentence,
        "bootstrap": None if scatter is None else {"trials": scatter.trials, "failed": scatter.failed},
    }
    model = valve_model(found, known, recordings, experiments, {"fit": runs, "holdout": held_out}, quality)
    return Identification(found, known, model, runs, held_out, checked, advice(known))


def plant_constants(experiments: Sequence[Experiment]) -> dict[str, float]:
    """The parameters that the recordings' plants fix, by full name, SI units."""
    return {
        parameter: float(e.plant[item])
        for e in experiments
        for item, parameter in PLANT_CONSTANTS.items()
        if item in e.plant
    }
