"""The same work on many items, on several processes. Results come back; nothing else is sent."""

from __future__ import annotations

import multiprocessing
import os
import signal
import time
from collections.abc import Callable, Sequence
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from threading import Thread
from typing import Any, TypeVar, cast

from recordings import Progress

Item = TypeVar("Item")


def in_processes(
    work: Callable[[Item], Any], items: Sequence[Item], count: int, progress: Progress, stage: str
) -> list[Any]:
    """``work(item)`` for every item, in their order, on `count` processes.

    The processes are forked, so that they know `work` and all it refers to; it need not be picklable, its results
    must be. With one process, or where there is no fork, the work is done here. Raises what `work` raises; an
    interrupt ends all processes at once.
    """
    progress(stage, 0, len(items))
    if count == 1 or len(items) < 2 or "fork" not in multiprocessing.get_all_start_methods():
        results = []
        for item in items:
            results.append(work(item))
            progress(stage, len(results), len(items))
        return results
    workers: dict[Connection, BaseProcess] = {}
    try:
        for _ in range(min(count, len(items))):
            pipe, worker = _forked(work, items)
            workers[pipe] = worker
        return _collected(workers, len(items), progress, stage)
    finally:
        for pipe, worker in workers.items():
            pipe.close()
            worker.terminate()  # one that is done waits for nothing; what another was at is not kept
            worker.join()


def _forked(work: Callable[[Item], Any], items: Sequence[Item]) -> tuple[Connection, BaseProcess]:
    fork = multiprocessing.get_context("fork")
    ours, theirs = fork.Pipe()
    worker = fork.Process(target=_serve, args=(work, items, theirs, os.getpid()), daemon=True)
    worker.start()
    theirs.close()  # so that the end of the process is the end of the pipe
    return ours, worker


def _collected(workers: dict[Connection, BaseProcess], n_items: int, progress: Progress, stage: str) -> list[Any]:
    """Hand out the places of the items one by one, to whoever has time, and collect the results."""
    places, results = iter(range(n_items)), dict[int, Any]()
    busy = dict[Connection, int]()

    def hand_out(pipe: Connection) -> None:
        place = next(places, None)
        if place is not None:
            pipe.send(place)
            busy[pipe] = place

    for pipe in workers:
        hand_out(pipe)
    while busy:
        for pipe in cast("list[Connection]", wait(list(busy))):
            results[busy.pop(pipe)] = _received(pipe)
            progress(stage, len(results), n_items)
            hand_out(pipe)
    return [results[place] for place in range(n_items)]


def _received(pipe: Connection) -> Any:
    try:
        done, result = pipe.recv()
    except EOFError:
        raise RuntimeError("a worker process ended before its work was done, perhaps for want of memory") from None
    if not done:
        raise result
    return result


def _serve(work: Callable[[Item], Any], items: Sequence[Item], pipe: Connection, parent: int) -> None:
    """The life of a worker. An interrupt is the parent's to handle; the worker does not outlive a killed parent."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    Thread(target=_exit_with, args=(parent,), daemon=True).start()
    while True:
        try:
            item = items[pipe.recv()]
        except EOFError:
            return
        try:
            answer: tuple[bool, Any] = (True, work(item))
        except Exception as error:
            answer = (False, error)
        pipe.send(answer)


def _exit_with(parent: int) -> None:
    while os.getppid() == parent:
        time.sleep(0.5)
    os._exit(1)
