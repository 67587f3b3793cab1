"""Linear plants (3.1), (3.13) with faults, and what can be observed of them."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from recordings import Array, BadInput

_NONE: Array = np.zeros((0, 0))
"""A matrix left out."""


@dataclass(frozen=True, eq=False)
class LinearPlant:
    """x(k+1) = A x + B u + R1 f, y = C x + D u + R2 f, equation (3.13); one step per reading.

    A (n, n), B (n, r), C (m, n), D (m, r), R1 (n, g), R2 (m, g); D, R1, R2 are zero where left out.
    Raises BadInput for shapes that do not fit.
    """

    A: Array
    B: Array
    C: Array
    D: Array = field(default_factory=lambda: _NONE)
    R1: Array = field(default_factory=lambda: _NONE)
    R2: Array = field(default_factory=lambda: _NONE)

    def __post_init__(self) -> None:
        for name in ("A", "B", "C", "D", "R1", "R2"):
            object.__setattr__(self, name, np.atleast_2d(np.asarray(getattr(self, name), float)))
        n, r, m = self.A.shape[0], self.B.shape[1], self.C.shape[0]
        g = max(self.R1.shape[1], self.R2.shape[1])
        shapes = {"A": (n, n), "B": (n, r), "C": (m, n), "D": (m, r), "R1": (n, g), "R2": (m, g)}
        for name, shape in shapes.items():
            if not getattr(self, name).size:
                object.__setattr__(self, name, np.zeros(shape))
            if getattr(self, name).shape != shape:
                raise BadInput("linear plant", f"{name} is {getattr(self, name).shape}", f"it has to be {shape}")

    @classmethod
    def sampled(
        cls, A: Array, B: Array, C: Array, dt: float, R1: Array | None = None, R2: Array | None = None
    ) -> LinearPlant:
        """From the continuous plant (3.1) without D, inputs and faults held over the step `dt` [s]."""
        from scipy.signal import cont2discrete

        A, B, C = (np.atleast_2d(np.asarray(one, float)) for one in (A, B, C))
        faults = np.zeros((len(A), 0 if R2 is None else np.shape(R2)[1])) if R1 is None else np.asarray(R1, float)
        joined = np.hstack([B, faults])
        discrete = cont2discrete((A, joined, C, np.zeros((len(C), joined.shape[1]))), dt)
        return cls(
            discrete[0],
            discrete[1][:, : B.shape[1]],
            C,
            _NONE,
            discrete[1][:, B.shape[1] :],
            _NONE if R2 is None else R2,
        )

    @property
    def order(self) -> int:
        """n."""
        return len(self.A)

    @property
    def sizes(self) -> tuple[int, int, int]:
        """Numbers of inputs r, outputs m, faults g."""
        return self.B.shape[1], self.C.shape[0], self.R1.shape[1]

    def observability(self, depth: int) -> Array:
        """W of (3.14): C, CA, ..., CA^depth, ((depth + 1) m, n)."""
        rows = [self.C]
        for _ in range(depth):
            rows.append(rows[-1] @ self.A)
        return np.vstack(rows)

    @property
    def observable(self) -> bool:
        """Whether (C, A) is observable, which the full-order observer needs for free poles."""
        return int(np.linalg.matrix_rank(self.observability(self.order - 1))) == self.order

    @property
    def observability_index(self) -> int:
        """mu: the least number for which C, ..., CA^(mu - 1) have rank n. Raises BadInput when there is none.

        The source prints powers up to mu, with which its own bound n/m <= mu does not hold.
        """
        for index in range(1, self.order + 1):
            if np.linalg.matrix_rank(self.observability(index - 1)) == self.order:
                return index
        raise BadInput("linear plant", "(C, A) is not observable", "leave out states that no output shows")

    def simulate(self, u: Array, x0: Array | None = None, f: Array | None = None) -> Array:
        """Outputs (n, m) for inputs (n, r) and faults (n, g)."""
        x = np.zeros(self.order) if x0 is None else np.asarray(x0, float)
        f = np.zeros((len(u), self.sizes[2])) if f is None else f
        y = np.empty((len(u), self.sizes[1]))
        for k in range(len(u)):
            y[k] = self.C @ x + self.D @ u[k] + self.R2 @ f[k]
            x = self.A @ x + self.B @ u[k] + self.R1 @ f[k]
        return y
