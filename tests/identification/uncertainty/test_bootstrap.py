"""Bootstrap of a fit: its scatter agrees with theory where theory holds, and too few trials are refused."""

from __future__ import annotations

import functools

import numpy as np
import pytest
from seeded_valves import recorded
from stiff_valves import STIFF, stem_test

from bristle.cli.app import run
from identification import Identification, experiment, fit, identify, uncertainty_of
from identification.uncertainty.bootstrap import bootstrap_of
from recordings import BadInput
from simulator import random_valve

TRIALS = 6


@functools.cache
def found(trials: int) -> Identification:
    reports: list[tuple[str, int, int]] = []
    result = identify([recorded(2)], bootstrap=trials, progress=lambda *one: reports.append(one), check=False)
    assert [one for one in reports if one[0] == "bootstrap"] == [("bootstrap", k + 1, trials) for k in range(trials)]
    stages = list(dict.fromkeys(stage for stage, _, _ in reports if stage != "bootstrap"))
    assert stages == ["starting values", "search", "fit to whole recordings", "uncertainty", "free runs"]
    return result


@pytest.mark.slow
def test_the_scatter_of_replicates_is_that_of_the_linearised_model_where_the_force_is_exact():
    plain, scattered = found(0), found(TRIALS)
    ratios = [scattered.uncertainty.spread[n] / plain.uncertainty.spread[n] for n in plain.uncertainty.names]
    assert 0.5 < np.median(ratios) < 1.7
    assert scattered.fit.values == plain.fit.values
    assert scattered.model.quality["bootstrap"] == {"trials": TRIALS, "failed": 0}
    assert plain.model.quality["bootstrap"] is None


@pytest.mark.slow
def test_intervals_of_replicates_hold_the_fit_and_differ_from_the_plain_ones():
    plain, scattered = found(0), found(TRIALS)
    assert scattered.uncertainty.spread != plain.uncertainty.spread
    assert all(s > 0 for s in scattered.uncertainty.spread.values())


def test_the_force_may_be_noisy():
    """Replicates of a noise-aware fit: spring and Coulomb friction free, the rest held."""
    soft = {"lugre.sigma0": 1e5, "lugre.sigma1": 300.0}
    given = {name: value for name, value in (STIFF | soft).items() if name not in ("spring.K", "lugre.fc")}
    [short] = stem_test(250.0, ("sine:4",), values=soft)
    found = identify([short], given=given, estimator="noise-aware", bootstrap=12, check=False)
    assert found.fit.estimator == "noise-aware"
    scatter, plain = found.uncertainty.spread, uncertainty_of(found.fit).spread
    for name in ("spring.K", "lugre.fc"):
        assert 0.4 < scatter[name] / plain[name] < 2.0


def test_too_few_trials_are_refused(capsys: pytest.CaptureFixture[str]):
    with pytest.raises(BadInput, match="5 or more"):
        identify([recorded(2)], bootstrap=3)
    assert run(["fit", "bundled:step", "--bootstrap", "-1"]) == 2
    assert "--bootstrap -1" in capsys.readouterr().err


@pytest.mark.slow
def test_replicates_are_fitted_under_priors_and_constraints_too():
    """A prior far tighter than the data leaves the parameter its own scatter; a constraint at which the fit ends holds
    in every replicate.
    """
    truth = random_valve(2)[0]
    std, least = 1e-5 * truth["spring.K"], 1.02 * truth["lugre.fs"]
    given = {name: value for name, value in truth.items() if name not in ("spring.K", "spring.F0", "lugre.fs")}
    fitted = fit(
        [experiment(recorded(2))], given=given, priors={"spring.K": (truth["spring.K"], std)},
        constraints=[f"lugre.fs>={least!r}"],
    )  # fmt: skip
    scatter = bootstrap_of(fitted, 8, seed=1)
    values = dict(zip(scatter.names, scatter.values.T, strict=True))
    assert 0.4 * std < np.std(values["spring.K"]) < 1.6 * std
    assert values["lugre.fs"].min() == pytest.approx(least, rel=1e-6)  # half of them would be below
