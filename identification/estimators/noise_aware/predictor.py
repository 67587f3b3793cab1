"""Where innovations come from: the smoother of the linearised model, or another predictor that is compared with it."""

from __future__ import annotations

from typing import Protocol

from identification.data.grid import Grid
from identification.estimators.coordinates import Coordinates
from identification.estimators.estimate import Innovations
from identification.estimators.noise_aware.linearised_model import PathFreedom, correction, linearise
from recordings import Array
from simulator import Kernel


class Predictor(Protocol):
    """How innovations come of a path, and where the path goes from there."""

    def line(
        self, kernel: Kernel, coordinates: Coordinates, grid: Grid, p: Array, path: Array, freedom: PathFreedom
    ) -> Innovations | None:
        """The innovations of a grid along a path (n, n_states) at parameters p; None where the model has none."""

    def toward(self, line: Innovations, move: Array | None = None, share: float = 1.0) -> Array:
        """The way (n, n_states) to the path about which it is linearised next, with the coordinates moved by (m,), or
        left where they are. share : fraction in [0, 1] of the step at unchanged coordinates; what `move` adds counts
        in full.
        """


class KalmanSmoother:
    """The linearised model, filtered along the path; the next path is the smoothed one (a `Predictor`)."""

    def line(
        self, kernel: Kernel, coordinates: Coordinates, grid: Grid, p: Array, path: Array, freedom: PathFreedom
    ) -> Innovations | None:
        """The innovations of the filter; None where the model has no solution."""
        return linearise(kernel, coordinates, grid, p, path, freedom)

    def toward(self, line: Innovations, move: Array | None = None, share: float = 1.0) -> Array:
        """The way (n, n_states) to the smoothed path, with the coordinates moved by (m,), or left where they are."""
        return correction(line, move, share)


KALMAN_SMOOTHER = KalmanSmoother()
