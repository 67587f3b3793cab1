"""The demo's source: read on while its reader is busy, so that nothing of the device's ring is lost."""

from __future__ import annotations

import asyncio

import pytest

from bristle.cli.demo.valve import Unhurried
from hil import Reading, Sample, Statistics


class Ring:
    """A device that keeps only its last two samples, and makes one at every turn of the loop."""

    def __init__(self, n: int, error: Exception | None = None) -> None:
        self.signals: dict[str, tuple[object, ...]] = {}
        self.statistics = Statistics()
        self._n, self._error, self._k = n, error, 0

    async def __aenter__(self):
        return self

    async def __aexit__(self, *_):
        return None

    async def __anext__(self) -> Sample:
        await asyncio.sleep(0)
        if self._k == self._n:
            raise self._error or StopAsyncIteration
        self._k += 1
        return Sample(float(self._k), 0.0, "V", {"position": Reading(1.0, "m")})

    def __aiter__(self):
        return self


def test_nothing_is_lost_while_the_reader_is_busy_and_the_end_comes_after_the_last_sample():
    async def taken() -> tuple[int, list[float]]:
        async with Unhurried(Ring(500)) as source:
            first = await anext(source)
            while source.waiting < 499:  # the reader is busy
                await asyncio.sleep(0)
            return source.waiting, [first.time, *[one.time async for one in source]]

    waiting, times = asyncio.run(taken())
    assert waiting == 499
    assert times == [float(k) for k in range(1, 501)]


def test_what_ends_the_source_is_raised():
    async def taken() -> None:
        async with Unhurried(Ring(3, OSError("gone"))) as source:
            async for _ in source:
                pass

    with pytest.raises(OSError, match="gone"):
        asyncio.run(taken())
