"""A server from start to stop: says where it listens, runs until it is told to stop, says how it went."""

from __future__ import annotations

import json
import signal
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from hil.plant.plant import ServedPlant
from hil.running import Stop, first_of
from hil.server.server import Server, ServerSettings


@dataclass(frozen=True)
class ServerEnd:
    """Why a session ended: the signal that stopped it, None when its duration was over."""

    stopped_by: signal.Signals | None


async def serve_session(
    plants: Mapping[int, ServedPlant], settings: ServerSettings, duration: float | None, say: Callable[[str], None]
) -> ServerEnd:
    """Serve until `duration` [s] is over or SIGINT or SIGTERM comes.

    `say` gets one line of JSON when all addresses listen, and one at the end with the lateness of every unit.
    Raises BadInput for what cannot be served, and whatever stops plant time.
    """
    async with Server(plants, settings) as server:
        with Stop(duration) as stop:
            say(json.dumps(opening_line(server, settings)))
            await first_of(stop.event.wait(), server.failed())
        say(json.dumps(closing_line(server, stop.first_signal)))
    return ServerEnd(stop.first_signal)


def opening_line(server: Server, settings: ServerSettings) -> dict[str, object]:
    """What a session says when all addresses listen."""
    mode = "lock-step" if settings.speed is None else f"{settings.speed:g} x real time"
    return {
        "listening": server.addresses,
        "units": list(server.units),
        "mode": mode,
        "map": settings.read_map.name,
        "write_map": settings.write_map.name if settings.write_map else None,
    }


def closing_line(server: Server, stopped_by: signal.Signals | None) -> dict[str, object]:
    """What a session says at its end, with the lateness of every unit."""
    units: dict[str, dict[str, float]] = {}
    for unit_id, unit in server.units.items():
        units[str(unit_id)] = {"samples": unit.samples, "requests": unit.requests, "refused": unit.refused}
        report = unit.report()
        if report is not None:
            units[str(unit_id)] |= {
                "lateness_p50_s": round(report.p50, 6),
                "lateness_p99_s": round(report.p99, 6),
                "lateness_max_s": round(report.maximum, 6),
            }
    return {"stopped_by": stopped_by.name if stopped_by else "duration", "units": units}
