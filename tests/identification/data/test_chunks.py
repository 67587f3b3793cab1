"""Cutting long recordings into chunks: they lie within the recording, in order, where they are said to."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from hypothesis import given
from hypothesis import strategies as st

from identification.data.chunks import centred, regular, to_the_ends

lengths = st.integers(1, 400)
counts = st.integers(1, 12)


@pytest.mark.parametrize("cut", [to_the_ends, centred])
@given(spare=st.integers(0, 5000), length=lengths, count=counts)
def test_as_many_as_asked_for_all_of_one_length_in_order(
    cut: Callable[[int, int, int], list[slice]], spare: int, length: int, count: int
):
    n = length + spare
    found = cut(n, length, count)
    assert len(found) == count
    assert {chunk.stop - chunk.start for chunk in found} == {length}
    assert [chunk.start for chunk in found] == sorted(chunk.start for chunk in found)
    assert found[0].start >= 0
    assert found[-1].stop <= n


@given(spare=st.integers(0, 5000), length=lengths, count=st.integers(2, 12))
def test_the_ends_are_reached_or_left_at_both_sides_alike(spare: int, length: int, count: int):
    n = length + spare
    ends = to_the_ends(n, length, count)
    assert (ends[0].start, ends[-1].stop) == (0, n)
    middle = centred(n, length, count)
    assert abs(middle[0].start - (n - middle[-1].stop)) <= 1


@given(n=st.integers(1, 5000), length=lengths, distance=lengths)
def test_regular_chunks_are_a_distance_apart_and_none_that_fits_is_left_out(n: int, length: int, distance: int):
    found = regular(n, length, distance)
    assert [chunk.start for chunk in found] == [distance * i for i in range(len(found))]
    assert all(chunk.stop - chunk.start == length and chunk.stop <= n for chunk in found)
    assert distance * len(found) + length >= n


@given(n=st.integers(1, 300), count=counts)
def test_a_chunk_longer_than_the_recording_is_the_recording(n: int, count: int):
    assert centred(n, n + 50, count) == [slice(0, n)] * count
