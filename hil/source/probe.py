"""One read of every register of a map: raw, decoded, with its quality, and under the other byte orders.

A wrong byte order shows at once: the values of the map are wild or not good, and those of another order are not.
Nothing is written: the link that is used cannot.
"""

from __future__ import annotations

import asyncio
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import get_args

from hil.client.link import Link
from hil.client.state import Input
from hil.client.transport import LiveAddress
from hil.modbus.messages import Reply, ReplyFault, Request
from hil.registers.codec import decode
from hil.registers.point import BIT_TABLES, ByteOrder, Point
from hil.registers.register_map import ReadBlock
from hil.source.sample import Quality, Reading
from hil.source.valve import BlockRead, Valve
from recordings import LinkError

PATIENCE_S = 5.0
"""How long a connection may take [s]: it is tried again and again."""
ORDERS: Sequence[ByteOrder] = get_args(ByteOrder)
LEAST, MOST = 1e-9, 1e12
"""Sizes between which the floats of a device lie, zero aside: a wrong order makes nearly any exponent of them."""


@dataclass(frozen=True)
class ProbedPoint:
    """One point. words : its registers or its bit, empty when they were not read; reading : value and quality by the
    map; others : what the value would be under the other byte orders, None where it would not be good.
    """

    point: Point
    words: tuple[int, ...]
    reading: Reading
    others: Mapping[ByteOrder, float | None]

    @property
    def raw(self) -> str:
        """The registers in hexadecimal, a bit as it is.

        >>> level = Point(name="level", table="input", address=0, type="uint16")
        >>> ProbedPoint(level, (255,), Reading(255.0, "1"), {}).raw
        '00FF'
        """
        digits = "d" if self.point.table in BIT_TABLES else "04X"
        return " ".join(f"{word:{digits}}" for word in self.words)


@dataclass(frozen=True)
class ProbedValve:
    """Every point of a valve; `advice` : sentences on what looks wrong, and what to change."""

    valve: str
    points: tuple[ProbedPoint, ...]

    @property
    def good(self) -> int:
        """Points with a good value."""
        return sum(one.reading.good for one in self.points)

    @property
    def likely_order(self) -> ByteOrder | None:
        """The byte order under which more values of several registers can be than under the map's; else None."""
        told = [one for one in self.points if one.words and one.others and one.point.count > 1]
        if not told:
            return None
        scores = {order: sum(_natural(one, order) for one in told) for order in ORDERS}
        own = sum(_natural(one, one.point.byte_order) for one in told)
        best = max(ORDERS, key=lambda order: scores[order])
        return best if scores[best] > own else None

    @property
    def advice(self) -> tuple[str, ...]:
        """What to look at, in sentences."""
        found = []
        likely = self.likely_order
        if likely is not None:
            told = [one for one in self.points if one.words and one.others and one.point.count > 1]
            fit = sum(_natural(one, likely) for one in told)
            own = sum(_natural(one, one.point.byte_order) for one in told)
            found.append(
                f"by the map {own} of {len(told)} values of several registers can be, in the order {likely} {fit}: "
                f'try byte_order = "{likely}"'
            )
        refused = [one.point.name for one in self.points if not one.words]
        if refused:
            found.append(f"not read: {', '.join(refused)}; check table, address and device id")
        return tuple(found)


async def probe(address: LiveAddress, valves: Sequence[Valve]) -> tuple[ProbedValve, ...]:
    """Read every register of some valves behind an address once.

    Raises LinkError when there is no connection or nobody answers, and BadInput as `Link` does.
    """
    news: asyncio.Queue[tuple[Input, str]] = asyncio.Queue()
    link = Link(address, lambda happening, text: news.put_nowait((happening, text)))
    running = asyncio.ensure_future(link.run())
    try:
        await _opened(address, running, news)
        return tuple([await _probed(link, valve) for valve in valves])
    finally:
        running.cancel()
        await asyncio.gather(running, return_exceptions=True)


async def _opened(address: LiveAddress, running: asyncio.Future[None], news: asyncio.Queue[tuple[Input, str]]) -> None:
    """Wait for the connection. Raises what ended the link, or LinkError with the last reason."""
    text = f"{address.text}: no answer to the attempt to connect"
    try:
        async with asyncio.timeout(PATIENCE_S + address.timeout):
            while True:
                heard = asyncio.ensure_future(news.get())
                await asyncio.wait((heard, running), return_when=asyncio.FIRST_COMPLETED)
                if not heard.done():
                    heard.cancel()
                    await running  # raises what is wrong
                    raise LinkError(text)
                happening, text = heard.result()
                if happening is Input.OPENED:
                    return
    except TimeoutError:
        raise LinkError(f"{text}; check address, cable and port") from None


async def _probed(link: Link, valve: Valve) -> ProbedValve:
    """Raises LinkError when no device of the valve says anything."""
    words: dict[str, tuple[int, ...]] = {}
    reasons: dict[str, str] = {}
    silent: dict[int, str] = {}
    for block in valve.map.reads():
        if block.unit_id in silent:
            reasons |= dict.fromkeys((one.name for one in block.points), silent[block.unit_id])
            continue
        reply = await _asked(link, block)
        if reply.device_silent:
            silent[block.unit_id] = f"device {block.unit_id} does not answer ({reply.text})"
        if reply.fault is ReplyFault.EXCEPTION and len(block.points) > 1:  # a hole that the device does not have
            for point in block.points:
                alone = ReadBlock(point.unit_id, point.table, point.address, point.count, (point,))
                _take(alone, await _asked(link, alone), words, reasons)
        else:
            _take(block, reply, words, reasons)
    if silent and not words:
        raise LinkError(f"{link.address.text}: {'; '.join(silent.values())}; check the device id and the line")
    return ProbedValve(valve.name, tuple(_decoded(point, words, reasons) for point in valve.map.points))


async def _asked(link: Link, block: ReadBlock) -> Reply:
    """The reply to one read, asked for once more when it got lost."""
    request = BlockRead(block).request
    reply = await _exchanged(link, request)
    return reply if reply.fault in (None, ReplyFault.EXCEPTION) else await _exchanged(link, request)


async def _exchanged(link: Link, request: Request) -> Reply:
    while link.listens(request.unit):
        await asyncio.sleep(0.05)
    return await link.exchange(request)


def _take(block: ReadBlock, reply: Reply, words: dict[str, tuple[int, ...]], reasons: dict[str, str]) -> None:
    for point in block.points:
        if reply.fault is None:
            words[point.name] = tuple(block.registers_of(point, reply.words))
        else:
            reasons[point.name] = reply.text


def _decoded(point: Point, words: Mapping[str, tuple[int, ...]], reasons: Mapping[str, str]) -> ProbedPoint:
    if point.name not in words:
        return ProbedPoint(point, (), Reading(math.nan, point.unit, Quality.LINK, reasons.get(point.name, "")), {})
    own = words[point.name]
    found = decode(point, own)
    reading = Reading.of(found, point.unit, math.nan)
    return ProbedPoint(point, own, reading, {order: decode(_in(point, order), own).value for order in _others(point)})


def _others(point: Point) -> tuple[ByteOrder, ...]:
    """The orders that differ from the map's for a point: one register has but two."""
    if point.table in BIT_TABLES:
        return ()
    choice: Sequence[ByteOrder] = ORDERS if point.count > 1 else ("ABCD", "BADC")
    own = point.byte_order if point.count > 1 else "BADC" if point.byte_order in ("BADC", "DCBA") else "ABCD"
    return tuple(order for order in choice if order != own)


def _in(point: Point, order: ByteOrder) -> Point:
    return point.model_copy(update={"byte_order": order})


def _natural(one: ProbedPoint, order: ByteOrder) -> bool:
    """Whether a value of several registers can be under an order: good, and if a float of a usual size."""
    value = decode(_in(one.point, order), one.words).value
    if value is None:
        return False
    if one.point.type not in ("float32", "float64") or value == one.point.offset:
        return True
    return LEAST <= abs((value - one.point.offset) / one.point.scale) <= MOST
