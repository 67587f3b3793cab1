"""A monitor as the page shows it: for `bristle monitor` with one source, which is no service of supervised tasks."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping
from datetime import UTC, datetime
from types import MappingProxyType

from hil.monitor.event import MonitorEvent
from hil.monitor.monitor import Monitor
from hil.service.acquisition import ValveLink
from hil.service.health import Standing, ValveFacts
from hil.service.recent import NewestEvents, RecentRing
from hil.service.status import PlantStatus, RecentSamples, ValveStatus
from hil.source.sample import LinkEvent, Sample
from simulator import ValveModel


class ShownMonitor:
    """What a monitor and its source know, as values for the page.

    name : of the plant; source : its address; rate_hz : of the source; model : of the valves; late : how many deadlines
    were missed so far. It is told every item after the monitor has taken it; see `take`.
    """

    def __init__(
        self, name: str, source: str, rate_hz: float, monitor: Monitor, model: ValveModel,
        late: Callable[[], int] = lambda: 0,
    ) -> None:  # fmt: skip
        self._name, self._late = name, late
        self._valves = {tag: _ShownValve(tag, source, rate_hz, monitor, model) for tag in monitor.valves}

    def take(self, item: Sample | LinkEvent, event: MonitorEvent | None) -> None:
        """An item of the source, and the event that the monitor made of it."""
        self._valves[item.valve].take(item, event)

    def status(self) -> PlantStatus:
        """How everything stands now."""
        now = datetime.now(UTC)
        return PlantStatus(self._name, now, tuple(one.status(now, self._late()) for one in self._valves.values()), ())

    def recent(self, tag: str) -> RecentSamples:
        """The newest samples of a valve. Raises KeyError for a tag that there is not."""
        return self._valves[tag].ring.samples()


class _ShownValve:
    def __init__(self, tag: str, source: str, rate_hz: float, monitor: Monitor, model: ValveModel) -> None:
        self._tag, self._monitor = tag, monitor
        self._link = ValveLink(tag, source, rate_hz, ())
        self._standing, self._alarm_text = Standing.first(), ""
        self._events = NewestEvents()
        self._stroke_m, self._area_m2 = (_known(model, name) for name in ("stroke_m", "diaphragm_area_m2"))
        self.ring = RecentRing(math.isfinite(self._stroke_m), True)

    def take(self, item: Sample | LinkEvent, event: MonitorEvent | None) -> None:
        self._link.take(item, time.monotonic())
        if event is not None:
            self._events.add(event)
            self._alarm_text = event.text if event.kind == "alarm" else self._alarm_text
        watch = self._monitor.valves[self._tag]
        if not isinstance(item, Sample) or watch.measured is None:
            return
        values, judgement = watch.measured.values, watch.judgement
        judged = judgement is not None and judgement.verdict.used
        self.ring.add(
            item.wall,
            values["position"],
            values.get("setpoint", math.nan) * self._stroke_m,
            values.get("force", values.get("pressure", math.nan) * self._area_m2),
            judgement.residual if judgement is not None and judged else math.nan,
            judgement.threshold if judgement is not None and judged else math.nan,
        )

    def status(self, now: datetime, late: int) -> ValveStatus:
        clock, watch = time.monotonic(), self._monitor.valves[self._tag].status
        facts = ValveFacts(
            self._link.age_s(clock), self._link.stale_s, self._link.connected, self._link.down,
            *self._link.unusable(clock), "", watch.phase, watch.so_far, watch.load, watch.fault,
            self._alarm_text, watch.judged, watch.supported,
        )  # fmt: skip
        self._standing = self._standing.after(facts, now)
        worst = self._standing.worst
        cause = worst.cause
        return ValveStatus(
            self._tag, cause.health, cause.reason, worst.since, cause.evidence, cause.check,
            self._link.status(clock, late), None, self._latest(facts), self._events.all, watch.phase, watch.load,
        )  # fmt: skip

    def _latest(self, facts: ValveFacts) -> Mapping[str, float]:
        """The newest values; none once they are stale, so that nobody takes them for fresh."""
        measured = self._monitor.valves[self._tag].measured
        if measured is None or not facts.connected or facts.age_s > facts.stale_s:
            return MappingProxyType({})
        return MappingProxyType({name: value for name, value in measured.values.items() if math.isfinite(value)})


def _known(model: ValveModel, name: str) -> float:
    """A number that the model knows of the plant; NaN where it does not."""
    value = model.plant.get(name)
    return value if isinstance(value, float) else math.nan
