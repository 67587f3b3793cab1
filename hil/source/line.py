"""One link and the devices on it: who may be asked now, who rests because it is silent, and what is announced."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field

from hil.client.link import Link
from hil.client.state import REST, Input, LinkPhase, LinkState
from hil.client.transport import LiveAddress
from hil.modbus.messages import Reply, ReplyFault, Request
from hil.source.sample import EventKind
from hil.source.valve import Valve

LISTENING = "not asked while a late reply may still come"

Announce = Callable[[str, EventKind, str], None]
"""Told of every event: the valve, the kind, and the text."""


@dataclass
class _Unit:
    valves: tuple[str, ...]
    state: LinkState = field(default_factory=LinkState)
    rests_until: float = 0.0
    reason: str = ""
    down_since: float | None = None


class DeviceLine:
    """Asks devices, and leaves a silent one alone for a while so that it costs the others one timeout a back-off.

    address : of the peer; valves : that the devices belong to; announce : see `Announce`; allow_write : as in `Link`.
    Raises BadInput as `Link` does.
    """

    def __init__(
        self, address: LiveAddress, valves: Iterable[Valve], announce: Announce, *, allow_write: bool = False
    ) -> None:
        of_unit: dict[int, list[str]] = {}
        for valve in valves:
            for unit in valve.units:
                of_unit.setdefault(unit, []).append(valve.name)
        self._units = {unit: _Unit(tuple(names)) for unit, names in of_unit.items()}
        self._announce = announce
        self.link = Link(address, self._link_changed, allow_write=allow_write)

    def reachable(self, valve: Valve) -> bool:
        """Whether some device of a valve answers, as far as is known."""
        return any(self._units[unit].state.announced == "link_up" for unit in valve.units)

    def rests(self, number: int) -> str | None:
        """Why a device is not to be asked now; None when it may be."""
        unit = self._units[number]
        if self.listens(number):
            return LISTENING
        return unit.reason if asyncio.get_running_loop().time() < unit.rests_until else None

    def listens(self, number: int) -> bool:
        """Whether a device cannot be asked for a while, because a late reply of its own may still come."""
        return self.link.listens(number)

    async def ask(self, request: Request) -> Reply:
        """Send a request, and draw the conclusions from its reply."""
        unit = self._units[request.unit]
        if unit.state.phase is LinkPhase.BACKOFF:
            self._step(request.unit, unit, Input.DUE, "")
        reply = await self.link.exchange(request)
        if reply.fault in (None, ReplyFault.EXCEPTION) and not reply.device_silent:
            if unit.state.phase is not LinkPhase.UP:
                self._step(request.unit, unit, Input.ANSWERED, "it answers")
        elif reply.fault is not ReplyFault.LOST:  # the link tells of a loss itself
            self._step(request.unit, unit, Input.UNANSWERED, reply.text)
            if reply.device_silent:
                rest = REST.delay(max(unit.state.unanswered, 1))
                unit.rests_until, unit.reason = asyncio.get_running_loop().time() + rest, reply.text
        return reply

    def _link_changed(self, happening: Input, text: str) -> None:
        """The connection opened or was lost: the same for every device."""
        for number, unit in self._units.items():
            unit.rests_until = 0.0
            self._step(number, unit, happening, text)

    def _step(self, number: int, unit: _Unit, happening: Input, text: str) -> None:
        unit.state, news = unit.state.after(happening)
        if news is None:
            return
        now = asyncio.get_running_loop().time()
        if news == "link_up" and unit.down_since is not None:
            text = f"it answers again, after {now - unit.down_since:.1f} s"
        unit.down_since = now if news == "link_down" else None
        for valve in unit.valves:
            self._announce(valve, news, f"unit {number}: {text}")
