"""What the observer remembers from sample to sample, and what it says."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from detector.observer import kernel
from detector.observer.screening import SampleVerdict
from recordings import Array, BadInput, Integers

_ESTIMATES = {"e1": kernel.E1, "b1": kernel.B1, "alpha1": kernel.A1, "alpha4": kernel.A4, "alpha5": kernel.A5}


@dataclass(frozen=True)
class ObserverState:
    """Everything an observer remembers, as numbers. core : errors, last sample, estimates, weights; screening and
    filter : of the screen and the velocity filter; n_first : how many weights are of S1.
    """

    core: Array
    screening: Array
    filter: Array
    n_first: int

    @property
    def xi1(self) -> float:
        """Position error x1 - x1hat."""
        return float(self.core[kernel.XI1])

    @property
    def xi2(self) -> float:
        """Velocity error x2 - x2hat, the residual."""
        return float(self.core[kernel.XI2])

    @property
    def rho(self) -> float:
        """The threshold."""
        return float(self.core[kernel.RHO_LAST])

    @property
    def w1(self) -> Array:
        """Weights of S1, a copy."""
        return self.core[kernel.WEIGHTS : kernel.WEIGHTS + self.n_first].copy()

    @property
    def w2(self) -> Array:
        """Weights of S2, a copy."""
        return self.core[kernel.WEIGHTS + self.n_first :].copy()

    @property
    def estimates(self) -> dict[str, float]:
        """e1, b1, alpha1, alpha4, alpha5."""
        return {name: float(self.core[place]) for name, place in _ESTIMATES.items()}

    def with_estimates(self, other: ObserverState) -> ObserverState:
        """The same with the estimates and weights of another state of this observer."""
        core = self.core.copy()
        places = list(_ESTIMATES.values())
        core[places], core[kernel.WEIGHTS :] = other.core[places], other.core[kernel.WEIGHTS :]
        return replace(self, core=core)

    def as_dict(self) -> dict[str, Any]:
        """Plain numbers and lists, for JSON; `ObserverState.from_dict` gives the same bits back."""
        parts = {name: getattr(self, name).tolist() for name in ("core", "screening", "filter")}
        return parts | {"n_first": self.n_first}

    @classmethod
    def from_dict(cls, parts: Mapping[str, Any]) -> ObserverState:
        """The state that `as_dict` wrote. Raises BadInput for anything else."""
        try:
            arrays = [np.array(parts[name], float) for name in ("core", "screening", "filter")]
            n_first = int(parts["n_first"])
            if not all(array.ndim == 1 and np.isfinite(array).all() for array in arrays):
                raise ValueError("not rows of finite numbers")
        except (KeyError, TypeError, ValueError) as error:
            raise BadInput("observer state", f"it cannot be read ({error})", "learn anew") from None
        return cls(arrays[0], arrays[1], arrays[2], n_first)


@dataclass(frozen=True, slots=True)
class Decision:
    """What the observer says of one sample. When the sample was skipped, the numbers are those before it.

    time_s [s]; xi2 : the residual [velocity]; rho : the threshold [velocity]; phi : Phi of (4.17) [acceleration];
    exceeded : whether the residual of this sample is above the threshold; alarm : whether there is an alarm now;
    verdict : what was made of the sample.
    """

    time_s: float
    xi2: float
    rho: float
    phi: float
    exceeded: bool
    alarm: bool
    verdict: SampleVerdict


@dataclass(frozen=True)
class Decisions:
    """Many decisions, as arrays: output (n_samples, 5); verdict (n_samples,); history (n_samples, n_core)."""

    time_s: Array
    output: Array
    verdict: Integers
    history: Array | None = None
    n_first: int = 0

    @property
    def xi2(self) -> Array:
        """The residual."""
        return self.output[:, kernel.RESIDUAL]

    @property
    def rho(self) -> Array:
        """The threshold."""
        return self.output[:, kernel.RHO]

    @property
    def phi(self) -> Array:
        """Phi of (4.17)."""
        return self.output[:, kernel.PHI]

    @property
    def exceeded(self) -> NDArray[np.bool_]:
        """Whether each residual is above the threshold."""
        return self.output[:, kernel.OVER] > 0

    @property
    def alarm(self) -> NDArray[np.bool_]:
        """Whether there is an alarm."""
        return self.output[:, kernel.ALARMED] > 0

    def past(self, name: str) -> Array:
        """The course of xi1, xi2, e1, b1, alpha1, alpha4 or alpha5 after each sample, of a run with ``history=True``.

        Raises BadInput for another name, or when the run had no history.
        """
        places = _ESTIMATES | {"xi1": kernel.XI1, "xi2": kernel.XI2}
        if name not in places or self.history is None:
            raise BadInput(
                f"history of {name}", "the run had none", f"run with history=True, and name one of {sorted(places)}"
            )
        return self.history[:, places[name]]

    @property
    def raised_s(self) -> Array:
        """Times at which an alarm began [s]; one that stands at the first decision counts."""
        return self.time_s[self.alarm & ~np.concatenate([[False], self.alarm[:-1]])]

    def first_alarm(self, since_s: float = -np.inf) -> float | None:
        """Time of the first decision at or after `since_s` with an alarm [s], None when there is none."""
        hits = self.time_s[self.alarm & (self.time_s >= since_s)]
        return float(hits[0]) if len(hits) else None

    def __len__(self) -> int:
        return len(self.time_s)

    def __getitem__(self, i: int) -> Decision:
        xi2, rho, phi, exceeded, alarm = self.output[i].tolist()
        verdict = SampleVerdict(int(self.verdict[i]))
        return Decision(float(self.time_s[i]), xi2, rho, phi, exceeded > 0, alarm > 0, verdict)

    def __iter__(self) -> Iterator[Decision]:
        return (self[i] for i in range(len(self)))
