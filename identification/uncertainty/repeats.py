"""Repeats of one test: by how much the fits to the single recordings differ, beside what their intervals explain.

An interval says what the noise of its recordings leaves open, under the model. What differs from test to test of one
valve, temperature or the rest before it, is not in it. Only repeats show that.

The ratio of the standard deviation between the fits to the root mean square of their own is judged by chi-square, with
the degrees of freedom that unequal variances leave (Satterthwaite, Biometrics Bulletin 2, 1946).
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from scipy.stats import chi2

from identification.budget import Budget
from identification.data.experiment import Experiment
from identification.estimators.fitted import Fit, Outcome
from identification.uncertainty.covariance import uncertainty_of
from recordings import Array, BadInput, BadParameter, NegativeAnswer, Progress, silent

LEVEL = 0.01
"""Probability that any parameter is said to differ where the intervals explain all, over all parameters together."""
FEWEST = 2
"""Recordings, and fits that count, of which a spread is computed at least."""
LATE = "the time allowed was over before its fit had ended"
"""Why a fit does not count that had no time."""
UNEXPLAINED = (Outcome.NOT_CONVERGED, Outcome.NOT_EXPLAINED)
"""How a fit to all ends where one set of values does not explain them."""


@dataclass(frozen=True)
class SingleFit:
    """The fit to one of the repeats alone. recording : its name; values, std : of the parameters that are `identified`
    in it, by full name, SI units; failed : why it does not count, None where it does; estimator : which one made it.
    """

    recording: str
    values: dict[str, float]
    std: dict[str, float]
    failed: str | None = None
    estimator: str | None = None


@dataclass(frozen=True)
class Spread:
    """What repeats say of one parameter.

    count : single fits in which it is `identified`; mean : of these, in the unit of the parameter; std : standard
    deviation between these, with ``count - 1`` in the denominator; explained : root mean square of their own standard
    deviations, which is what their intervals allow `std` to be; exceeds : whether `std` is more than chance makes of
    that. mean, std and explained are None where fewer than two fits count.
    """

    count: int
    mean: float | None = None
    std: float | None = None
    explained: float | None = None
    exceeds: bool = False

    @property
    def ratio(self) -> float | None:
        """The spread between the repeats over what the intervals explain."""
        return None if self.std is None or not self.explained else self.std / self.explained


@dataclass(frozen=True)
class Repeats:
    """Repeats of one test. singles : the fits, in the order of the recordings; spreads : by full name, of every free
    parameter; together : whether one set of values explains them all.
    """

    singles: tuple[SingleFit, ...]
    spreads: dict[str, Spread]
    together: bool = True

    def spread_of(self, name: str) -> str:
        """The spread of a parameter in words, with the number of fits that count; empty for one that is held."""
        spread = self.spreads.get(name)
        if spread is None:
            return ""
        return f"{'none' if spread.std is None else f'{spread.std:.2g}'} ({spread.count})"

    def sentences(self) -> list[str]:
        """What the engineer is to know: which fits do not count, and which parameters differ from test to test."""
        said = [f"{one.recording}: not counted among the repeats: {one.failed}" for one in self.singles if one.failed]
        beyond = {name: spread.ratio for name, spread in self.spreads.items() if spread.exceeds}
        if beyond:
            much = ", ".join(f"{name} {_times(ratio)} times" for name, ratio in beyond.items() if ratio)
            said.append(
                f"The repeats differ by more than their intervals explain: {much}. Such an interval holds for its "
                "recordings, not for the valve on another day: judge a change of the valve by the spread between "
                "repeats."
            )
        elif any(spread.std is not None for spread in self.spreads.values()):
            unknown = [name for name, spread in self.spreads.items() if spread.std is None]
            but = f" No spread is known of {', '.join(unknown)}." if unknown else ""
            said.append(f"The repeats differ by no more than their intervals and chance explain.{but}")
        else:
            said.append("No spread between the repeats is known: no parameter is identified in two of the single fits.")
        means = [f"{name} {spread.mean:.6g}" for name, spread in self.spreads.items() if spread.mean is not None]
        if not self.together and means:
            said.append(
                "No one set of values explains all recordings together. The means of the single fits that converged "
                f"are {', '.join(means)} (SI units)."
            )
        return said

    def as_json(self) -> dict[str, Any]:
        """The content of ``quality.repeats`` in `model.json`."""
        spreads = {name: asdict(spread) | {"ratio": spread.ratio} for name, spread in self.spreads.items()}
        fits = [asdict(one) for one in self.singles]
        return {"level": LEVEL, "parameters": spreads, "fits": fits, "sentences": self.sentences()}


def _times(ratio: float) -> str:
    """A ratio to three digits, without an exponent."""
    return f"{ratio:.0f}" if ratio >= 100 else f"{ratio:.3g}"


def check_repeats(recordings: int) -> None:
    """Raise BadParameter for too few recordings to be repeats."""
    if recordings < FEWEST:
        found = "one recording has no spread" if recordings else "there is no recording"
        raise BadParameter("repeats", "", found, f"give {FEWEST} or more recordings of one test, or leave it out")


def repeats_of(
    found: Fit, experiments: Sequence[Experiment], fit_one: Callable[[Experiment], Fit], time: Budget,
    progress: Progress = silent,
) -> Repeats:  # fmt: skip
    """Fit every experiment alone and compare what comes out.

    found : the fit to all of them, for its free parameters; fit_one : a fit under the same conditions to one; time :
    what is left for the fits: those that are not done then do not count.
    """
    singles = []
    for done, (name, e) in enumerate(zip(_names(experiments), experiments, strict=True)):
        progress("repeats", done, len(experiments))
        singles.append(_single(name, e, fit_one, time))
    progress("repeats", len(experiments), len(experiments))
    free = found.coordinates.free_names
    spreads = {name: _spread(name, singles, LEVEL / len(free)) for name in free}
    return Repeats(tuple(singles), spreads, together=found.outcome not in UNEXPLAINED)


def _names(experiments: Sequence[Experiment]) -> list[str]:
    """The names of the recordings, with their places where they share one."""
    shared = Counter(e.name for e in experiments)
    return [e.name if shared[e.name] == 1 else f"{e.name} {i + 1}" for i, e in enumerate(experiments)]


def _single(name: str, e: Experiment, fit_one: Callable[[Experiment], Fit], time: Budget) -> SingleFit:
    if time.over:
        return SingleFit(name, {}, {}, LATE)
    try:
        with time.in_force():
            found = fit_one(e)
    except (BadInput, NegativeAnswer) as error:
        return SingleFit(name, {}, {}, str(error))
    if found.outcome is not Outcome.CONVERGED:
        why = LATE if found.outcome is Outcome.OUT_OF_TIME else found.outcome.value
        return SingleFit(name, {}, {}, why, found.estimator)
    known = uncertainty_of(found)
    told = [n for n in known.names if known.status[n] == "identified"]
    values, std = ({n: of[n] for n in told} for of in (found.values, known.spread))
    return SingleFit(name, values, std, estimator=found.estimator)


def _spread(name: str, singles: Sequence[SingleFit], level: float) -> Spread:
    """The spread of one parameter; level : probability that it is said to exceed its intervals by chance."""
    counted = [one for one in singles if name in one.values]
    if len(counted) < FEWEST:
        return Spread(len(counted))
    values, variances = np.array([(one.values[name], one.std[name] ** 2) for one in counted]).T
    std, explained = float(np.std(values, ddof=1)), float(np.sqrt(np.mean(variances)))
    freedom = _freedom(variances)
    exceeds = freedom * std**2 > float(chi2.isf(level, freedom)) * explained**2
    return Spread(len(counted), float(values.mean()), std, explained, exceeds)


def _freedom(variances: Array) -> float:
    """Degrees of freedom of the spread of values with such variances (n,): n - 1 where they are equal."""
    n = len(variances)
    centred = (np.eye(n) - 1.0 / n) * variances
    return float(np.trace(centred) ** 2 / np.trace(centred @ centred))
