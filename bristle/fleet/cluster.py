"""Where the tasks of a fleet are done: a Dask cluster of this machine, or a scheduler that is there already."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any

from bristle.fleet.work import Row, analysed
from recordings import BadInput, LinkError

TASK = "bristle"
"""What the keys of our tasks begin with, for those who look at the scheduler."""

LIMITS = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"), "1")
"""A worker for each core, and one thread in each."""

REACHED_S = 30.0
"""A scheduler answers within this, or it is not there [s]."""

ATTEMPTS = 3
"""Workers that may die over a task before the task is given up."""


@contextmanager
def opened(scheduler: str | None, workers: int | None) -> Iterator[Any]:
    """A client of a scheduler by address, or of a cluster of processes on this machine that ends with the block.

    The cluster listens on loopback, and only with certificates made for it: whoever reaches a scheduler can run
    programs. Raises BadInput when there is no such scheduler.
    """
    import dask
    import distributed

    quiet = {"distributed.scheduler.allowed-failures": ATTEMPTS, "distributed.admin.tick.limit": "1h"}
    with dask.config.set(quiet):
        if scheduler is not None:
            with _connected(distributed, scheduler) as client:
                yield client
            return
        with (
            dask.config.set({"distributed.nanny.pre-spawn-environ": LIMITS}),
            distributed.LocalCluster(
                n_workers=workers or os.cpu_count() or 1, threads_per_worker=1, processes=True, host="127.0.0.1",
                dashboard_address=None, security=True, silence_logs=50, memory_limit=0,
            ) as cluster,
            distributed.Client(cluster) as client,
        ):  # fmt: skip
            yield client


@contextmanager
def _connected(distributed: Any, scheduler: str) -> Iterator[Any]:
    try:
        client = distributed.Client(scheduler, timeout=REACHED_S, set_as_default=False)
    except (OSError, ValueError, TimeoutError) as error:
        reason = " ".join(str(error).split()) or type(error).__name__
        raise BadInput(
            scheduler, f"no scheduler answers there ({reason[:120]})", "start one, or leave it out"
        ) from None
    with client:
        yield client


def rows_of(client: Any, tasks: Mapping[str, tuple[Any, ...]]) -> Iterator[Row]:
    """The rows of tasks as they are done, in any order; each once, whatever happens to workers meanwhile.

    tasks : arguments of `analysed` by key. The first is done alone: it compiles what all of them need, and the others
    find it in the cache. A task that ends its workers is a row that says so. Raises LinkError when the scheduler goes.
    """
    keys = list(tasks)
    for part in (keys[:1], keys[1:]):
        yield from _rows_of(client, {key: tasks[key] for key in part})


def _rows_of(client: Any, tasks: Mapping[str, tuple[Any, ...]]) -> Iterator[Row]:
    from distributed import as_completed

    futures = {
        client.submit(analysed, *arguments, key=f"{TASK}-{key}", pure=False): key for key, arguments in tasks.items()
    }
    for future in as_completed(futures, loop=client.loop):
        key = futures[future]
        if future.status == "finished":
            yield future.result()
        elif future.status == "error":
            yield _failed(tasks[key], future.exception())
        else:
            raise LinkError("the scheduler is gone, or has dropped the work; what is done is kept: start again")
        future.release()


def here(tasks: Mapping[str, tuple[Any, ...]]) -> Iterator[Row]:
    """The rows of tasks, done in this process one after the other."""
    for arguments in tasks.values():
        yield analysed(*arguments)


def _failed(arguments: tuple[Any, ...], error: BaseException) -> Row:
    """The row of a task that could not be done by any worker."""
    _, item, _, key, _ = arguments
    killed = getattr(error, "allowed_failures", None)  # of Dask's KilledWorker
    reason = f"{type(error).__name__}: {error}" if killed is None else f"it ended {killed + 1} workers"
    known = {"valve": item.valve, "type": item.kind, "date": item.date, "recordings": ";".join(item.recordings)}
    return {**known, "key": key, "state": "failed", "sentence": reason, "page": None}
