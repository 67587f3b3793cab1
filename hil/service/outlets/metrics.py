"""Numbers for Prometheus: made of a snapshot whenever it asks; every name has its unit at its end."""

from __future__ import annotations

import asyncio
import logging
import math
from collections.abc import Callable, Iterator
from typing import Protocol

from prometheus_client import CollectorRegistry, ProcessCollector, start_http_server
from prometheus_client.core import CounterMetricFamily, GaugeMetricFamily, Metric
from prometheus_client.registry import Collector

from hil.service.in_service.figures import InServiceFigures, Trended
from hil.service.status import Health, PlantStatus, ValveStatus

LOOK_S = 1.0

LOG = logging.getLogger("bristle.monitor")


class MeasuredService(Protocol):
    """What is asked of a service."""

    def status(self) -> PlantStatus: ...

    def counts(self, tag: str) -> dict[str, int]:
        """Events of a valve by kind."""

    def recorded(self, tag: str) -> int | None:
        """Samples of a valve that are safe on the disk; None where nothing is recorded."""


Gauge = tuple[str, str, Callable[[ValveStatus], float | None]]

_VALVE_GAUGES: tuple[Gauge, ...] = (
    ("health_level", "NE 107: 0 good, 1 maintenance, 2 out of specification, 3 check function, 4 failure",
     lambda v: v.health.rank),
    ("health_since_timestamp_seconds", "Since when it is in this state, POSIX", lambda v: v.since.timestamp()),
    ("link_connected", "Whether the device answers", lambda v: float(v.link.connected)),
    ("last_good_sample_age_seconds", "Time since the last good position", lambda v: v.link.age_s),
    ("position_meters", "Stem position; absent while it is stale", lambda v: v.latest.get("position")),
    ("alarm_load_ratio", "Largest score of the detector, an alarm at 1", lambda v: v.load),
)  # fmt: skip

_VALVE_COUNTERS: tuple[Gauge, ...] = (
    ("samples", "Samples taken", lambda v: v.link.samples),
    ("samples_dropped", "Samples that a full queue dropped", lambda v: v.link.lost),
    ("deadlines_missed", "Deadlines missed on the valve's source", lambda v: v.link.late),
    ("reconnects", "Times the link came back", lambda v: v.link.reconnects),
)

_FIGURES: tuple[tuple[str, str, Callable[[InServiceFigures], Trended | None]], ...] = (
    ("friction_newtons", "Friction from movements in service", lambda f: _newtons(f.friction)),
    ("spring_rate_newtons_per_meter", "Spring rate from movements in service", lambda f: f.spring_rate),
    ("dead_band_percent", "Dead band, of span", lambda f: f.dead_band),
    ("step_dead_time_seconds", "Td of steps", lambda f: f.dead_time),
    ("step_t86_seconds", "T86 of steps", lambda f: f.t86),
    ("step_overshoot_percent", "Overshoot of steps", lambda f: f.overshoot),
)

_TRAVELLED: tuple[tuple[str, str, Callable[[InServiceFigures], float]], ...] = (
    ("travelled_strokes", "Whole travel, in strokes", lambda f: f.travelled_strokes),
    ("reversals", "Changes of direction", lambda f: float(f.reversals)),
    ("observed_seconds", "Time with good values", lambda f: f.observed_s),
)


def _newtons(found: Trended | None) -> Trended | None:
    return found if found is not None and found.unit == "N" else None


class PlantCollector(Collector):
    """Turns a service's snapshot into metrics."""

    def __init__(self, service: MeasuredService) -> None:
        self._service = service

    def collect(self) -> Iterator[Metric]:
        """All metrics now."""
        status = self._service.status()
        yield from _of_valves(status)
        yield from self._counted(status)
        yield from _of_figures(status)
        yield from _of_tasks(status)

    def describe(self) -> list[Metric]:
        """Nothing beforehand: a snapshot costs less than keeping names twice."""
        return []

    def _counted(self, status: PlantStatus) -> Iterator[Metric]:
        events = CounterMetricFamily("bristle_valve_events", "Events by kind", labels=("valve", "kind"))
        safe = CounterMetricFamily("bristle_valve_samples_recorded", "Samples safe on the disk", labels=("valve",))
        for valve in status.valves:
            for kind, n in sorted(self._service.counts(valve.tag).items()):
                events.add_metric((valve.tag, kind), n)
            recorded = self._service.recorded(valve.tag)
            if recorded is not None:
                safe.add_metric((valve.tag,), recorded)
        yield events
        yield safe


def _of_valves(status: PlantStatus) -> Iterator[Metric]:
    for name, words, of in _VALVE_GAUGES:
        gauge = GaugeMetricFamily(f"bristle_valve_{name}", words, labels=("valve",))
        for valve in status.valves:
            value = of(valve)
            if value is not None and not math.isnan(value):
                gauge.add_metric((valve.tag,), value)
        yield gauge
    for name, words, of in _VALVE_COUNTERS:
        counter = CounterMetricFamily(f"bristle_valve_{name}", words, labels=("valve",))
        for valve in status.valves:
            counter.add_metric((valve.tag,), of(valve) or 0.0)
        yield counter
    state = GaugeMetricFamily("bristle_valve_health", "1 for the state it is in", labels=("valve", "state"))
    for valve in status.valves:
        for health in Health:
            state.add_metric((valve.tag, health.value), float(health is valve.health))
    yield state


def _of_figures(status: PlantStatus) -> Iterator[Metric]:
    known = [(valve.tag, valve.figures) for valve in status.valves if valve.figures is not None]
    for name, words, of in _FIGURES:
        gauge = GaugeMetricFamily(f"bristle_valve_{name}", words, labels=("valve", "end"))
        for tag, figures in known:
            found = of(figures)
            if found is not None:
                for end in ("value", "lower", "upper"):
                    gauge.add_metric((tag, end), getattr(found.now, end))
        yield gauge
    for name, words, total in _TRAVELLED:
        counter = CounterMetricFamily(f"bristle_valve_{name}", words, labels=("valve",))
        for tag, figures in known:
            counter.add_metric((tag,), total(figures))
        yield counter


def _of_tasks(status: PlantStatus) -> Iterator[Metric]:
    running = GaugeMetricFamily("bristle_task_running", "Whether the task runs", labels=("task",))
    restarts = CounterMetricFamily("bristle_task_restarts", "Times it was begun anew", labels=("task",))
    dropped = CounterMetricFamily("bristle_task_items_dropped", "Items it was too slow for", labels=("task",))
    for task in status.tasks:
        running.add_metric((task.name,), float(task.running))
        restarts.add_metric((task.name,), task.restarts)
        dropped.add_metric((task.name,), task.dropped)
    yield from (running, restarts, dropped)


def registry_of(service: MeasuredService) -> CollectorRegistry:
    """Everything that is exported: of the valves, of the tasks, and of the process itself."""
    registry = CollectorRegistry()
    registry.register(PlantCollector(service))
    ProcessCollector(registry=registry)
    return registry


class MetricsServer:
    """Answers Prometheus at an address, in threads of its own. port : as it is, once it runs, where 0 was asked for."""

    def __init__(self, service: MeasuredService, host: str, port: int) -> None:
        self._registry, self._host, self._asked = registry_of(service), host, port
        self.port = port

    async def run(self) -> None:
        """Serve until cancelled. Raises OSError when the address is taken, and RuntimeError when the server ended."""
        server, thread = start_http_server(self._asked, self._host, self._registry)
        self.port = server.server_port
        LOG.info("metrics at http://%s:%d/metrics", self._host, self.port)
        try:
            while thread.is_alive():
                await asyncio.sleep(LOOK_S)
            raise RuntimeError("the server of metrics has ended")
        finally:
            server.shutdown()
            server.server_close()
