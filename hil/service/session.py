"""One run of the service as a program: outlets from the plant file, signals that stop it, how it ended."""

from __future__ import annotations

import signal
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

from hil.running import Stop
from hil.server.address import NetworkAddress, listen_address
from hil.service.outlets.json_lines import JsonLines, Printed
from hil.service.outlets.mqtt import MqttSink
from hil.service.outlets.program import ProgramSink
from hil.service.outlets.sink import EventSink
from hil.service.plan import ServicePlan
from hil.service.service import Service, ServiceOutlets, ServiceTask
from recordings import BadInput


@dataclass(frozen=True)
class ServiceSession:
    """duration_s : stop after so long [s]; metrics : address instead of the file's; program : run for every event;
    more : tasks beside the service, made for it; started : told the service once it is made.
    """

    duration_s: float | None = None
    metrics: str | None = None
    program: Path | None = None
    more: Callable[[Service], Mapping[str, ServiceTask]] = lambda service: {}
    started: Callable[[Service], None] = lambda service: None


@dataclass(frozen=True)
class ServiceEnd:
    """How it ended. stopped_by : the signal, None for the end of the time or of the sources."""

    alarms: int
    seconds: float
    stopped_by: signal.Signals | None


def http_address(text: str, where: str, expose: bool) -> tuple[str, int]:
    """Host and port of ``HOST:PORT``. Raises BadInput for another form, or for one that other machines can reach."""
    try:
        address = listen_address(f"tcp://{text.removeprefix('http://').rstrip('/')}")
    except BadInput:
        raise BadInput(where, f"'{text}' is no address to listen on", "write for example 127.0.0.1:9108") from None
    assert isinstance(address, NetworkAddress)
    if not (address.loopback or expose):
        found = f"other machines can reach {text}"
        raise BadInput(where, found, "listen on 127.0.0.1, or set expose = true if you mean it")
    return address.host, address.port


def outlets_of(plan: ServicePlan, metrics: str | None = None, program: Path | None = None) -> ServiceOutlets:
    """The outlets that a plant file names. Raises BadInput for what of them cannot be used."""
    plant = plan.plant
    sinks: list[EventSink] = [JsonLines(plant.path(plant.events.file))] if plant.events.file else []
    if plant.events.mqtt is not None:
        sinks.append(MqttSink(plant.events.mqtt, plant))
    if program is not None:
        if not program.is_file():
            raise BadInput(str(program), "there is no such program", "give the path of one", parameter="on_event")
        sinks.append(ProgramSink(program.resolve()))
    if not sinks:
        sinks.append(Printed())
    entry = plant.metrics
    if metrics is not None:
        return ServiceOutlets(sinks, http_address(metrics, "metrics", bool(entry and entry.expose)))
    where = f"{plant.file}: metrics.listen"
    return ServiceOutlets(sinks, http_address(entry.listen, where, entry.expose) if entry else None)


async def run_service(plan: ServicePlan, session: ServiceSession) -> ServiceEnd:
    """Run the service until the duration is over, SIGINT or SIGTERM comes, or every source has ended.

    Raises BadInput as `Service` and `outlets_of` do.
    """
    service = Service(plan, outlets_of(plan, session.metrics, session.program))
    session.started(service)
    with Stop(session.duration_s) as stop:
        await service.run(stop.event, session.more(service))
    return ServiceEnd(service.alarms, stop.seconds, stop.first_signal)
