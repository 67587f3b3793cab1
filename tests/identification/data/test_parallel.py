"""Work in threads: results in order, errors after all has ended, and no waiting for one another."""

from __future__ import annotations

import multiprocessing
import threading
from concurrent.futures import ThreadPoolExecutor

import pytest

from identification import one_thread
from identification.parallel import WORKERS, each


def squares(count: int) -> list[int]:
    return each(lambda i: i * i, range(count))


def test_results_come_in_the_order_of_the_items():
    assert squares(50) == [i * i for i in range(50)]
    assert squares(0) == []


def test_items_are_worked_on_at_the_same_time():
    together = threading.Barrier(WORKERS)
    assert len(each(lambda _: together.wait(timeout=30), range(WORKERS))) == WORKERS


def test_all_threads_are_kept_for_the_next_call():
    names = {name for _ in range(20) for name in each(lambda _: threading.current_thread().name, range(4))}
    assert len(names) <= WORKERS


def test_who_asks_for_one_thread_does_all_work_alone_and_nobody_else_does():
    def names(_: int) -> set[str]:
        return set(each(lambda _: threading.current_thread().name, range(4)))

    with one_thread():
        assert names(0) == {threading.current_thread().name}
        with ThreadPoolExecutor(1) as other:
            assert threading.current_thread().name not in other.submit(names, 0).result()
    assert threading.current_thread().name not in names(0)


def test_the_first_error_is_raised_when_all_work_has_ended():
    done = []

    def work(i: int) -> None:
        if i in (1, 2):
            raise ValueError(f"item {i}")
        done.append(i)

    with pytest.raises(ValueError, match="item 1"):
        each(work, range(6))
    assert sorted(done) == [0, 3, 4, 5]


def test_work_may_ask_for_work():
    assert each(lambda i: sum(squares(i + 2)), range(6)) == [sum(j * j for j in range(i + 2)) for i in range(6)]


def test_a_forked_process_has_threads_of_its_own():
    assert squares(3) == [0, 1, 4]
    with multiprocessing.get_context("fork").Pool(1) as pool:
        assert pool.apply_async(squares, (4,)).get(timeout=30) == [0, 1, 4, 9]
