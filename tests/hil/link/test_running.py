"""How a session ends, what it repeats, and how it runs beside a synchronous program."""

from __future__ import annotations

import asyncio
import os
import signal
import threading
from collections import Counter

import pytest
from link_peers import within

from hil.running import LoopThread, Stop, repeating


def test_a_session_ends_with_its_duration():
    async def story() -> Stop:
        with Stop(0.01) as stop:
            await within(stop.event.wait())
        return stop

    stop = asyncio.run(story())
    assert stop.first_signal is None


@pytest.mark.parametrize("which", [signal.SIGINT, signal.SIGTERM])
def test_a_session_ends_with_a_signal_and_hears_none_afterwards(which):
    before = signal.getsignal(which)

    async def story() -> Stop:
        with Stop(60.0) as stop:
            os.kill(os.getpid(), which)
            await within(stop.event.wait())
        return stop

    stop = asyncio.run(story())
    assert (stop.first_signal, stop.signals) == (which, [which])
    if which is signal.SIGTERM:
        assert signal.getsignal(which) == before


def test_a_job_is_repeated_until_the_session_ends():
    async def story() -> list[int]:
        times, enough = list[int](), asyncio.Event()

        def work() -> None:
            times.append(len(times))
            if len(times) == 3:
                enough.set()

        with repeating(Counter(), (0.001, work)):
            await within(enough.wait())
        done = list(times)
        for _ in range(5):
            await asyncio.sleep(0)
        assert times == done
        return done

    assert asyncio.run(story())[:3] == [0, 1, 2]


def test_a_job_that_fails_is_counted_and_tried_again():
    async def story() -> Counter[str]:
        failures, enough = Counter[str](), asyncio.Event()

        def work() -> None:
            if failures.total() == 2:
                enough.set()
            raise OSError("the terminal has gone")

        with repeating(failures, (0.001, work)):
            await within(enough.wait())
        return failures

    (words,) = asyncio.run(story())
    assert "the terminal has gone" in words


def test_a_loop_in_a_thread_gives_results_and_errors_and_is_gone_after_closing():
    async def answer() -> str:
        return threading.current_thread().name

    async def fail() -> None:
        raise LookupError("nothing here")

    thread = LoopThread("bristle test")
    assert thread.run(answer()) == "bristle test"
    with pytest.raises(LookupError, match="nothing here"):
        thread.run(fail())
    thread.close()
    thread.close()
    assert "bristle test" not in {one.name for one in threading.enumerate()}


def test_what_still_runs_is_cancelled_when_the_loop_is_closed():
    ended = threading.Event()

    async def wait_for_ever() -> None:
        try:
            await asyncio.Event().wait()
        finally:
            ended.set()

    thread = LoopThread("bristle test")
    thread.start(wait_for_ever())
    thread.run(asyncio.sleep(0))
    thread.close()
    assert ended.is_set()
