"""The protocol of the estimators of paths and parameters, so that models are tried alike whatever is predicted."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Protocol

from identification.data.grid import Grid
from identification.estimators.coordinates import Coordinates
from identification.estimators.estimate import Estimate
from recordings import Array
from simulator import Kernel


class PathEstimator(Protocol):
    """One kernel fitted to some grids.

    `NoiseAware` predicts the position and estimates the path of all states along with the parameters; `ImposedMotion`
    predicts the force, and its paths follow from the parameters, so that steps and paths change nothing there.
    """

    @property
    def kernel(self) -> Kernel:
        """The model."""

    @property
    def coordinates(self) -> Coordinates:
        """What is free."""

    @property
    def grids(self) -> Sequence[Grid]:
        """What it is fitted to."""

    def start(self, theta: Array, steps: int = ...) -> Estimate | None:
        """The estimate at parameters theta (m,) along new paths that take so many steps. None where it diverges."""

    def along(self, theta: Array, paths: Sequence[Array], steps: int) -> Estimate | None:
        """The estimate at parameters theta (m,) along paths, one (n, n_states) for every grid, after so many steps of
        them. None where the model diverges.
        """

    def refit(
        self, theta: Array, paths: Sequence[Array], steps: int, vain: Callable[[Estimate], bool] | None = None
    ) -> Estimate | None:
        """The estimate after at most so many Gauss-Newton steps along paths that another model left, and where slips
        are short along new ones as well. vain : whether it is, to go on. None where the model diverges.
        """

    def descend(self, now: Estimate, steps: int, vain: Callable[[Estimate], bool] | None = None) -> Estimate:
        """The estimate after at most so many Gauss-Newton steps. vain : whether it is, to go on, where they tell."""

    def first(self, theta: Array, steps: int) -> Estimate | None:
        """The estimate that says, by its cost, whether theta (m,) is a good start: after at most so many Gauss-Newton
        steps, or none where slips are short. None where the model diverges.
        """

    def further(self, first: Estimate, steps: int, vain: Callable[[Estimate], bool]) -> Estimate:
        """The estimate after at most so many Gauss-Newton steps from a `first` one. vain : whether it is, to go on."""

    def fit(self, theta: Array, steps: int, vain: Callable[[Estimate], bool] | None = None) -> Estimate | None:
        """The estimate after at most so many Gauss-Newton steps from theta (m,), along new paths, which where slips are
        short are new at every step. vain : whether it is, to go on after a third of them, where the costs on
        the way tell. None where the model diverges.
        """
