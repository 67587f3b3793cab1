"""What the detector of a valve remembers from measurement to measurement."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from detector.alarms import EvidenceState
from detector.observer.state import ObserverState
from detector.watch.model.generator import ModelState, model_state_as_dict, model_state_from_dict
from recordings import Array, BadInput


@dataclass(frozen=True)
class WatchState:
    """What the detector remembers of a valve. positioner : of its loop, a row; evidence : of its residuals; levels : a
    sum for each pressure; over_s : time of the last score above its limit [s]; kind : name of the alarm so far;
    last_s : last used time [s]; remaining : without a kind, those that the evidence leaves.
    """

    observer: ObserverState
    positioner: Array | None
    model: ModelState | None
    evidence: EvidenceState
    levels: tuple[float, ...]
    alarm: bool = False
    over_s: float = 0.0
    kind: str | None = None
    last_s: float = 0.0
    remaining: tuple[str, ...] = ()

    def as_dict(self) -> dict[str, Any]:
        """Plain numbers and lists, for JSON."""
        positioner = None if self.positioner is None else self.positioner.tolist()
        model = None if self.model is None else model_state_as_dict(self.model)
        rest: dict[str, Any] = {name: getattr(self, name) for name in ("alarm", "over_s", "kind", "last_s")}
        rest["remaining"] = list(self.remaining)
        parts = {"observer": self.observer.as_dict(), "positioner": positioner, "model": model}
        return parts | {"evidence": self.evidence.as_dict(), "levels": list(self.levels)} | rest

    @classmethod
    def from_dict(cls, parts: Mapping[str, Any]) -> WatchState:
        """The state that `as_dict` wrote. Raises BadInput for anything else."""
        try:
            positioner = None if parts["positioner"] is None else np.array(parts["positioner"], float)
            model = None if parts["model"] is None else model_state_from_dict(parts["model"])
            levels, evidence = tuple(map(float, parts["levels"])), EvidenceState.from_dict(parts["evidence"])
            rest: dict[str, Any] = {name: parts[name] for name in ("alarm", "over_s", "kind", "last_s")}
            rest["remaining"] = tuple(map(str, parts["remaining"]))
            observer = ObserverState.from_dict(parts["observer"])
        except (KeyError, TypeError, ValueError, AttributeError) as error:
            raise BadInput("state of the detector", f"it cannot be read ({error!r})", "learn anew") from None
        return cls(observer, positioner, model, evidence, levels, **rest)
