"""The flow equation, learned: what flows through the valve against position and pressure drop."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from detector.generators.contract import Generator
from recordings import Array, BadInput

_FLAT = 1e-6


@dataclass(frozen=True)
class Flow(Generator):
    """(F - F^) / deviation with F^ = sqrt(drop) exp(polynomial of X), limited to the span of the transmitter.

    Inputs: P1 - P2, in shares of its mean; outputs: X and F [1]. logarithm : coefficients of the polynomial of X - 1/2,
    lowest first; noise_x, noise_f : deviations of the transmitters [1]. The deviation is that of a residual at this
    position: where the flow is steep in X, the noise of X counts most.
    """

    logarithm: tuple[float, ...]
    noise_x: float
    noise_f: float

    @property
    def width(self) -> tuple[int, int, int]:
        """One input, two outputs, one residual."""
        return 1, 2, 1

    def initial(self) -> Array:
        """Nothing to remember."""
        return np.zeros(0)

    def expected(self, drop: Array, x: Array) -> tuple[Array, Array]:
        """Flow (n,) that a drop and a position lead to, not limited, and its slope over X (n,)."""
        z = x - 0.5
        flow = np.sqrt(np.maximum(drop, 0.0)) * np.exp(np.clip(np.polynomial.polynomial.polyval(z, self._logs), -20, 5))
        return flow, flow * np.polynomial.polynomial.polyval(z, np.polynomial.polynomial.polyder(self._logs))

    def deviation(self, drop: Array, x: Array) -> Array:
        """Standard deviation (n,) of F - F^ without a fault."""
        flow, slope = self.expected(drop, x)
        doubt = np.abs(slope) * self.noise_x
        # Beyond the span the flow is limited, and its slope with it; near the limit X may be wrong by its noise.
        return np.sqrt(self.noise_f**2 + np.where(flow < 1 + 4 * doubt, doubt, 0.0) ** 2)

    @property
    def _logs(self) -> Array:
        return np.array(self.logarithm)

    def _advance(self, state: Array, u: Array, y: Array) -> tuple[Array, Array]:
        flow, _ = self.expected(u[:, 0], y[:, 0])
        return state, ((y[:, 1] - np.minimum(flow, 1.0)) / self.deviation(u[:, 0], y[:, 0]))[:, None]


def learn_flow(drop: Array, x: Array, f: Array, order: int = 5, noise_x: float = 1.5e-3) -> Flow:
    """Fit to fault-free readings (n,): least squares on the logarithm where the transmitter is not saturated.

    noise_x : of the position [1]. Raises BadInput when hardly any reading can be used.
    """
    usable = np.isfinite(drop + x + f) & (drop > 0) & (f > 0.02) & (f < 0.95)
    if usable.sum() < 100:
        raise BadInput("fault-free data", f"{usable.sum()} readings with a flow inside the span", "give 100 at least")
    d, z, y = drop[usable], x[usable] - 0.5, f[usable]
    powers = np.vander(z, order + 1, increasing=True)
    target, weight = np.log(y) - 0.5 * np.log(d), y / np.sqrt(noise_x**2 + (5 * y * noise_x) ** 2)
    for _ in range(3):
        solved, *_ = np.linalg.lstsq(powers * weight[:, None], target * weight, rcond=None)
        # A reading above 0.95 is left out by its true flow, not by its noise, or the fit is bent there.
        keep = np.sqrt(d) * np.exp(powers @ solved) < 0.9
        weight = np.where(keep, weight, 0.0)
    learned = Flow(tuple(solved.tolist()), noise_x, noise_x)
    standard = float(np.std(learned.run(learned.initial(), d[:, None], np.column_stack([z + 0.5, y]))[1][keep]))
    return Flow(learned.logarithm, noise_x * max(standard, _FLAT), noise_x * max(standard, _FLAT))
