"""The server: plants behind Modbus registers, on as many listeners as asked for, following the clock or on demand."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import TracebackType
from typing import Self

from hil.modbus.tls import Certificates
from hil.plant.pace import LatenessReport, Pace
from hil.plant.plant import ServedPlant
from hil.registers.register_map import RegisterMap, WriteMap
from hil.server.address import NetworkAddress, ServerAddress
from hil.server.endpoint import Endpoint, open_endpoint
from hil.server.handler import Room
from hil.server.layout import layout
from hil.server.unit import ServedUnit
from hil.server.wire import Clock
from recordings import BadInput

SHORTEST_LOOK = 0.0025
LONGEST_LOOK = 0.05
"""How often plant time is brought up to the clock while nobody asks [s], the shortest for one unit, in proportion for
several; every request does it for its unit as well."""


@dataclass(frozen=True)
class ServerSettings:
    """What a server does besides serving its plants.

    listen : addresses; read_map, write_map : the registers (None: nothing can be written); speed : plant time over
    real time, None for lock-step; expose : listen where other machines can reach it; harm : faults by register;
    certificates : for TLS.
    """

    listen: Sequence[ServerAddress]
    read_map: RegisterMap
    write_map: WriteMap | None = None
    speed: float | None = 1.0
    expose: bool = False
    harm: bool = False
    certificates: Certificates | None = None

    def exposure(self) -> list[str]:
        """What it means to listen where other machines are, a sentence per address. Raises BadInput unless allowed."""
        seen = [a for a in self.listen if isinstance(a, NetworkAddress) and not a.loopback]
        for address in seen:
            if not self.expose:
                found = "other machines could reach this address"
                found += "" if address.kind == "tls" else " without a password"
                remedy = "listen on 127.0.0.1, or expose it if it is meant"
                raise BadInput(address.at(address.port), found, remedy, parameter="expose")
        return [_meaning(address, self.write_map is not None, self.harm) for address in seen]


class Server:
    """Serves plants by unit id. Use as an asynchronous context manager.

    plants : by unit id, 1 to 247; clock : monotonic [s]. Entering raises BadInput when an address cannot be used or a
    map does not fit the plants.
    """

    def __init__(
        self, plants: Mapping[int, ServedPlant], settings: ServerSettings, clock: Clock = time.monotonic
    ) -> None:
        self.settings, self._plants, self._clock = settings, dict(plants), clock
        self.units: dict[int, ServedUnit] = {}
        self._endpoints: list[Endpoint] = []
        self._follower: asyncio.Task[None] | None = None

    async def __aenter__(self) -> Self:
        self.settings.exposure()
        self.units.update({unit_id: self._unit(unit_id, plant) for unit_id, plant in self._plants.items()})
        room, certificates = Room(), self.settings.certificates
        try:
            for address in self.settings.listen:
                self._endpoints.append(await open_endpoint(address, self.units, self._clock, certificates, room))
        except BaseException:
            await self._close()
            raise
        for unit in self.units.values():
            unit.run(True, self._clock())
        self._follower = asyncio.create_task(self._follow())
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None
    ) -> None:
        if self._follower is not None:
            self._follower.cancel()
            await asyncio.wait({self._follower})
        await self._close()

    @property
    def addresses(self) -> list[str]:
        """Where clients find the server, one per listener."""
        return [endpoint.address for endpoint in self._endpoints]

    async def failed(self) -> None:
        """Wait until plant time cannot go on, and raise what stopped it; while all is well this never returns."""
        assert self._follower is not None
        await asyncio.shield(self._follower)

    def reports(self) -> dict[int, LatenessReport | None]:
        """Lateness by unit id; None in lock-step."""
        return {unit_id: unit.report() for unit_id, unit in self.units.items()}

    def _unit(self, unit_id: int, plant: ServedPlant) -> ServedUnit:
        s = self.settings
        registers = layout(plant, s.read_map.on_unit(unit_id), s.write_map.on_unit(unit_id) if s.write_map else None)
        pace = None if s.speed is None else Pace(plant.step_s, s.speed)
        return ServedUnit(plant, registers, pace, s.harm)

    async def _follow(self) -> None:
        """Bring all units up to the clock again and again, leaving time for requests in between."""
        if self.settings.speed is None:
            await asyncio.Event().wait()
        step = min(plant.step_s for plant in self._plants.values()) / (self.settings.speed or 1.0)
        pause = min(max(step, SHORTEST_LOOK * len(self.units)), LONGEST_LOOK)
        while True:
            busy = [unit.follow(self._clock) for unit in self.units.values()]
            await asyncio.sleep(0 if max(busy) * step > pause else pause)

    async def _close(self) -> None:
        for endpoint in self._endpoints:
            await endpoint.close()


def _meaning(address: NetworkAddress, writes: bool, harm: bool) -> str:
    who = "with a certificate of your authority" if address.kind == "tls" else "without a password or encryption"
    can = ["read every value"] + ["write set points"] * writes + ["switch on faults"] * (writes and harm)
    return f"{address.at(address.port)} is exposed: whoever reaches it can, {who}, {' and '.join(can)}"
