"""The fit of a force-driven valve without starting values, in each order, but for an exact force in full order.

Runs in windows, set back to the data, find their way from nothing but the loop of force over position, at any sampling.
Where the force is noisy the noise-aware estimate goes on from there: it tells friction many times better. Where samples
do not show the course of a slip either of them may fail, and then the other is asked; where they show nothing of it but
its end, runs in windows are first.
"""

from __future__ import annotations

import functools
from collections.abc import Iterator, Sequence

from identification.data.experiment import Experiment
from identification.data.grid import Grid
from identification.estimators.coordinates import Coordinates
from identification.estimators.fitted import Fit, Outcome
from identification.estimators.noise_aware.fit import fit_noise_aware
from identification.estimators.order import Order
from identification.estimators.output_error.damped import Search, fit_in_windows, search_for
from identification.estimators.output_error.starting_values import StartingPoint
from recordings import Array, Progress, silent
from simulator import Kernel


def fit_damped(
    valve: Kernel, coordinates: Coordinates, smooth: Sequence[Experiment], order: Order = "damped",
    segment_grids: Sequence[Grid] = (), progress: Progress = silent, *, told: bool = True,
) -> Fit:  # fmt: skip
    """Fit a valve whose sampling does not resolve the bristle, without starting values.

    smooth : the experiments, with a smooth force; order : ``damped``, or ``static`` where no slip is resolved;
    segment_grids : of the experiments, where the recorded force is noisy; told : whether the order is asked for, or may
    become full where the search finds a swing that nodes between samples resolve: starting values may be too stiff.
    """
    progress("starting values", 0, 0)
    search = search_for(valve, coordinates, smooth, order)
    if search is None:
        return Fit(Outcome.TOO_SHORT, valve, coordinates)
    starts = search.ends(progress)

    def in_windows() -> Fit:
        return fit_in_windows(search, starts, order, progress)

    def noise_aware() -> Fit:
        found = fit_noise_aware(
            valve, coordinates, smooth, segment_grids, starts, "damped", progress, better=search.all_narrowed(starts),
            told=told, shows_slips=search.shows_slips,
        )  # fmt: skip
        return in_windows() if found.outcome is Outcome.DIVERGED else found

    if not (segment_grids and starts and order == "damped"):
        return in_windows()
    if search.shows_slips:
        return noise_aware()
    first, second = (in_windows, noise_aware) if search.jumps else (noise_aware, in_windows)
    found = first()
    if found.outcome is Outcome.CONVERGED:
        return found
    other = second()
    return other if other.outcome is Outcome.CONVERGED else found


class Starts:
    """Starting values (n_free,) where the sampling resolves the bristle, each made when it is asked for, and only once.

    search : the search by runs in windows, None where there is no loop of force over position; regression : starting
    values that are known beside it, the likeliest first.
    """

    def __init__(self, search: Search | None, regression: Sequence[Array], progress: Progress = silent) -> None:
        self._search, self.regression, self._progress = search, list(regression), progress
        self._narrowed = dict[int, Array | None]()

    @functools.cached_property
    def ends(self) -> list[Array]:
        """Where the search leads, the likeliest first."""
        return [] if self._search is None else self._search.ends(self._progress)

    @property
    def better_ends(self) -> Iterator[Array]:
        """What the narrow loss makes of the ends."""
        return self._better(range(len(self.ends)))

    @property
    def better_regression(self) -> Iterator[Array]:
        """What it makes of the starting values of the regression."""
        return self._better(range(len(self.ends), len(self.ends) + len(self.regression)))

    @property
    def all_better(self) -> Iterator[Array]:
        """The same of all, as far as there is a search."""
        yield from self.better_ends
        yield from (self.regression if self._search is None else self.better_regression)

    def _better(self, which: range) -> Iterator[Array]:
        if self._search is None:
            return
        for i in which:
            if i not in self._narrowed:
                self._narrowed[i] = self._search.narrowed([*self.ends, *self.regression][i])
            found = self._narrowed[i]
            if found is not None:
                yield found


def fit_full(
    valve: Kernel, coordinates: Coordinates, smooth: Sequence[Experiment], segment_grids: Sequence[Grid],
    starts: Starts, progress: Progress = silent,
) -> Fit:  # fmt: skip
    """Fit a valve whose sampling resolves the bristle, and whose recorded force is noisy.

    smooth : the experiments, with a smooth force; segment_grids : of the experiments; starts : of `starting_points`.
    """
    first = [*starts.ends, *starts.regression]
    if not first:
        return Fit(Outcome.DIVERGED, valve, coordinates)
    better = starts.all_better
    return fit_noise_aware(valve, coordinates, smooth, segment_grids, first, "full", progress, better=better)


def starting_points(
    valve: Kernel, coordinates: Coordinates, smooth: Sequence[Experiment], ranked: Sequence[StartingPoint],
    progress: Progress = silent,
) -> Starts:  # fmt: skip
    """The starting values to which runs in windows lead, with those known beside them."""
    search = search_for(valve, coordinates, smooth, "damped")
    return Starts(search, [start.theta for start in ranked], progress)
