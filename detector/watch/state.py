"""What the detector of a valve remembers from measurement to measurement."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from detector.observer.state import ObserverState
from detector.watch.model.generator import ModelState, model_state_as_dict, model_state_from_dict
from recordings import BadInput


@dataclass(frozen=True)
class WatchState:
    """What the detector remembers of a valve. levels : a sum for each pressure; flow : the two sums of the flow;
    over_s : time of the last score above its limit [s]; kind : name of the alarm so far; last_s : last used time [s].
    """

    observer: ObserverState
    model: ModelState | None
    levels: tuple[float, ...]
    flow: tuple[float, float]
    alarm: bool = False
    over_s: float = 0.0
    kind: str | None = None
    last_s: float = 0.0

    def as_dict(self) -> dict[str, Any]:
        """Plain numbers and lists, for JSON."""
        model = None if self.model is None else model_state_as_dict(self.model)
        rest = {name: getattr(self, name) for name in ("alarm", "over_s", "kind", "last_s")}
        levels, flow = list(self.levels), list(self.flow)
        return {"observer": self.observer.as_dict(), "model": model, "levels": levels, "flow": flow} | rest

    @classmethod
    def from_dict(cls, parts: Mapping[str, Any]) -> WatchState:
        """The state that `as_dict` wrote. Raises BadInput for anything else."""
        try:
            model = None if parts["model"] is None else model_state_from_dict(parts["model"])
            levels, flow = tuple(map(float, parts["levels"])), tuple(map(float, parts["flow"]))
            rest = {name: parts[name] for name in ("alarm", "over_s", "kind", "last_s")}
            observer = ObserverState.from_dict(parts["observer"])
        except (KeyError, TypeError, ValueError, AttributeError) as error:
            raise BadInput("state of the detector", f"it cannot be read ({error!r})", "learn anew") from None
        if len(flow) != 2:
            raise BadInput("state of the detector", "it belongs to another detector", "learn anew")
        return cls(observer, model, levels, (flow[0], flow[1]), **rest)
