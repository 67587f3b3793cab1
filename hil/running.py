"""How long a session goes on, what it does again and again meanwhile, and how it runs beside a synchronous program."""

from __future__ import annotations

import asyncio
import gc
import signal
import threading
from collections.abc import Awaitable, Callable, Coroutine, Iterator, Sequence
from contextlib import AbstractAsyncContextManager, contextmanager, nullcontext, suppress
from types import TracebackType
from typing import Any, Self, TypeVar

Result = TypeVar("Result")

RepeatedTask = tuple[float, Callable[[], None]]
"""Something to do again and again, after the seconds of rest between two times."""

SIGNALS = (signal.SIGINT, signal.SIGTERM)


async def first_of(*work: Awaitable[object], held: AbstractAsyncContextManager[object] | None = None) -> None:
    """Do several things at once until one of them has ended; then cancel the others, and wait until they have ended.

    held : a lock to have while they are cancelled, so that what may not be interrupted is not. Raises what one of them
    raised, the first in the order of `work`.
    """
    tasks = [asyncio.ensure_future(one) for one in work]
    try:
        await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
    finally:
        async with held or nullcontext():
            for task in tasks:
                task.cancel()
        ends = await asyncio.gather(*tasks, return_exceptions=True)
    for end in ends:
        if isinstance(end, Exception):
            raise end


class Stop:
    """The end of a session: SIGINT, SIGTERM, or a duration that is over. A context manager inside a running event loop.

    `event` is set when the session is to end.

    Parameters
    ----------
    duration_s : float, optional
        How long the session lasts [s], from entering on; None for no limit.
    heard : sequence of signals, optional
        The signals that end it. Only the main thread hears any; other threads give none.
    """

    def __init__(self, duration_s: float | None = None, heard: Sequence[signal.Signals] = SIGNALS) -> None:
        self.event = asyncio.Event()
        self.signals: list[signal.Signals] = []
        self._duration_s, self._heard_signals = duration_s, heard

    def __enter__(self) -> Self:
        self._loop = asyncio.get_running_loop()
        for which in self._heard_signals:
            self._loop.add_signal_handler(which, self._heard, which)
        self._entered = self._loop.time()
        self._timer = None if self._duration_s is None else self._loop.call_later(self._duration_s, self.event.set)
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        if self._timer is not None:
            self._timer.cancel()
        for which in self._heard_signals:
            self._loop.remove_signal_handler(which)

    @property
    def first_signal(self) -> signal.Signals | None:
        """The first signal that came; None when there was none."""
        return self.signals[0] if self.signals else None

    @property
    def seconds(self) -> float:
        """Time since the session was entered [s]."""
        return self._loop.time() - self._entered

    def _heard(self, which: signal.Signals) -> None:
        self.signals.append(which)
        self.event.set()


@contextmanager
def repeating(*jobs: RepeatedTask) -> Iterator[None]:
    """Do each job again and again while the context lasts. Needs a running event loop."""
    tasks = [asyncio.ensure_future(_repeat(every_s, work)) for every_s, work in jobs]
    try:
        yield
    finally:
        for task in tasks:
            task.cancel()


async def _repeat(every_s: float, work: Callable[[], None]) -> None:
    while True:
        await asyncio.sleep(every_s)
        work()


def freeze_garbage() -> None:
    """Tell the garbage collector to look no more at what is loaded now.

    Otherwise it goes through all modules again and again, for 60 ms and more at a time, while polls are due.
    """
    gc.collect()
    gc.freeze()


class LoopThread:
    """An event loop in a thread of its own, for synchronous programs. Close it when it is not needed any more.

    name : of the thread, for debuggers.
    """

    def __init__(self, name: str) -> None:
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._run, name=name, daemon=True)
        self._thread.start()

    @classmethod
    def entered(cls, name: str, entering: Coroutine[Any, Any, object]) -> LoopThread:
        """A thread in whose loop something was entered. Raises what that raises, and is closed then."""
        thread = cls(name)
        try:
            thread.run(entering)
        except BaseException:
            thread.close()
            raise
        return thread

    def start(self, work: Coroutine[Any, Any, Result]) -> asyncio.Task[Result]:
        """Begin something in the loop and return its task, which only the loop's thread may touch."""

        async def started() -> asyncio.Task[Result]:
            return asyncio.get_running_loop().create_task(work)

        return self.run(started())

    def run(self, work: Coroutine[Any, Any, Result]) -> Result:
        """Run something in the loop and wait for its result. Raises what it raises; an interruption cancels it."""
        future = asyncio.run_coroutine_threadsafe(work, self._loop)
        try:
            return future.result()
        except BaseException:
            future.cancel()
            raise

    def soon(self, call: Callable[[], object]) -> None:
        """Call something in the loop's thread, soon; not at all once it is closed."""
        with suppress(RuntimeError):
            self._loop.call_soon_threadsafe(call)

    def close(self) -> None:
        """Cancel what still runs, and end the thread. A second call does nothing."""
        with suppress(RuntimeError):  # the loop is closed already
            self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join()

    def _run(self) -> None:
        asyncio.set_event_loop(self._loop)
        with asyncio.Runner(loop_factory=lambda: self._loop) as runner:  # cancels and closes everything at its end
            runner.get_loop().run_forever()
