"""The source: where a valve's values come from, whatever is behind it, and never a wrong one."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import TracebackType
from typing import Protocol, Self

from hil.registers.register_map import WriteMap
from hil.source.address import ReplayAddress, parse_address
from hil.source.live import LiveSource, ReadingPlan
from hil.source.replay import ReplaySource
from hil.source.sample import LinkEvent, Sample
from hil.source.statistics import Statistics
from hil.source.valve import Valve
from recordings import BadInput, SignalSpec


class Source(Protocol):
    """An asynchronous context manager and iterator of `Sample`s and `LinkEvent`s, in the order of time for each valve.

    signals : what a recording of each valve declares, by valve name; statistics : what it has done so far. Only a
    recording ends; a live source goes on until it is closed, or raises `PollingStopped`.
    """

    @property
    def signals(self) -> Mapping[str, tuple[SignalSpec, ...]]: ...

    @property
    def statistics(self) -> Statistics: ...

    async def __aenter__(self) -> Self: ...

    async def __aexit__(self, kind: type | None, error: BaseException | None, trace: TracebackType | None) -> None: ...

    def __aiter__(self) -> Self: ...

    async def __anext__(self) -> Sample | LinkEvent: ...


class SourceWrapper:
    """A source that wraps another: opened and closed with it, with the same signals. A subclass adds `__anext__`."""

    def __init__(self, source: Source) -> None:
        self._source = source
        self.signals: Mapping[str, tuple[SignalSpec, ...]] = source.signals
        self.statistics = source.statistics

    async def __aenter__(self) -> Self:
        await self._source.__aenter__()
        return self

    async def __aexit__(self, kind: type | None, error: BaseException | None, trace: TracebackType | None) -> None:
        await self._source.__aexit__(kind, error, trace)

    def __aiter__(self) -> Self:
        return self


def open_source(
    address: str,
    valves: Sequence[Valve] = (),
    plan: ReadingPlan | None = None,
    *,
    name: str | None = None,
    write_map: WriteMap | None = None,
    allow_write: bool = False,
) -> Source:
    """The source that an address means; `parse_address` lists the forms.

    valves, plan, write_map, allow_write : for a live source, see `LiveSource`; name : what to call the valve of a
    recording, which has signals of its own. Raises BadInput for whatever of it cannot be used.
    """
    where = parse_address(address)
    if isinstance(where, ReplayAddress):
        return ReplaySource(where, name)
    if not valves or plan is None:
        raise BadInput(address, "nothing says what to read there", "give a register map", parameter="map")
    return LiveSource(where, valves, plan, write_map=write_map, allow_write=allow_write)
