"""Which fault it is: symptoms after an alarm against a matrix of signatures learned in simulation.

A ranked list of the 19 faults by distance to their signatures. Faults that training itself confuses are named as a
group, for nobody can tell them apart by these symptoms.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from detector.evaluation.benchmark.runs import CV, X
from detector.evaluation.isolation.symptoms import MEMORIES, SCORES
from recordings import Array, BadInput, Integers

WINDOW_S = 300
"""Symptoms are taken together over so long [s], or since the alarm where that is less."""

EVERY_S = 30
"""A diagnosis is made so often [s] after an alarm began."""

_USED = np.concatenate([MEMORIES.index(m) * len(SCORES) + np.arange(len(SCORES)) for m in (10.0, 60.0)])
_OFF = 0.05
"""Unit in which the position's distance from the set point counts [share of the stroke]."""

_STILL = 1e-3
"""A rod that moves less than this counts as still: about its noise [share of the stroke]."""

_NEAREST = 1
_CONFUSED = 0.25
_FLOOR = 0.3


def feature_vectors(run: Array, symptoms: Array, alarm: NDArray[np.bool_]) -> tuple[Integers, Array]:
    """Rows at which a diagnosis is made, and what is then known: (n_rows, n_features): mean and spread of each symptom,
    their size taken by asinh, and of X - CV, over the window; and how much X moves, on a logarithmic scale. Symptoms
    saturate, so that one wild reading is soon forgotten; where the rod is, and whether it moves at all, tells those
    apart that saturate alike.
    """
    rows = np.arange(len(alarm))
    edge = alarm & ~np.concatenate([[False], alarm[:-1]])
    began = np.maximum.accumulate(np.where(edge, rows, -1))
    due = alarm & (began >= 0) & (rows > began) & ((rows - began) % EVERY_S == 0)
    at = np.flatnonzero(due)
    value = np.column_stack([np.arcsinh(symptoms[:, _USED]), (run[:, X] - run[:, CV]) / _OFF, run[:, X]])
    zero = np.zeros((1, value.shape[1]))
    sums, squares = (np.vstack([zero, np.cumsum(one, axis=0)]) for one in (value, value**2))
    first = np.maximum(began[at], at - WINDOW_S)
    n = (at - first + 1)[:, None]
    mean = (sums[at + 1] - sums[first]) / n
    spread = np.sqrt(np.maximum((squares[at + 1] - squares[first]) / n - mean**2, 0.0))
    return at, np.hstack([mean[:, :-1], spread[:, :-1], np.log(spread[:, -1:] + _STILL)])


@dataclass(frozen=True, eq=False)
class Diagnosis:
    """Signatures learned: features (n, n_features) of faults (n,), and the deviation (n_features,) within a fault;
    group : number of the group of each fault, by fault.
    """

    features: Array
    faults: Integers
    deviation: Array
    group: dict[int, int]

    def distances(self, features: Array) -> tuple[Integers, Array]:
        """Faults known (n_faults,), and distances (n, n_faults): to the nearest signatures of each fault."""
        known = np.unique(self.faults)
        apart = _apart(features / self.deviation, self.features / self.deviation)
        return known, np.column_stack([_nearest(apart[:, self.faults == fault]) for fault in known])

    def ranked(self, feature_row: Array) -> list[tuple[int, float]]:
        """Faults with their distance, nearest first."""
        known, apart = self.distances(feature_row[None])
        order = np.argsort(apart[0])
        return [(int(known[i]), float(apart[0, i])) for i in order]

    def flagged(self, run: Array, symptoms: Array, alarm: NDArray[np.bool_]) -> Integers:
        """The fault named first at each second (n,), 0 where none is: before the first diagnosis and without alarm."""
        named = np.zeros(len(alarm), np.int64)
        at, features = feature_vectors(run, symptoms, alarm)
        if len(at):
            known, apart = self.distances(features)
            marks = np.zeros(len(alarm), np.int64)
            marks[at] = np.arange(1, len(at) + 1)
            last = np.maximum.accumulate(marks)
            named = np.concatenate([[0], known[apart.argmin(axis=1)]])[last]
        return np.where(alarm, named, 0)

    def members(self, fault: int) -> tuple[int, ...]:
        """The faults of the group of a fault, itself among them."""
        if fault not in self.group:
            return (fault,)
        return tuple(other for other, number in self.group.items() if number == self.group[fault])

    def matrix(self) -> dict[int, Array]:
        """The signature matrix: mean features (n_features,) of every fault."""
        return {int(fault): self.features[self.faults == fault].mean(axis=0) for fault in np.unique(self.faults)}


def learn_diagnosis(examples: Sequence[tuple[int, str, Array]]) -> Diagnosis:
    """From examples: fault, name of the run it comes from, features (n, n_features). Raises BadInput for none."""
    usable = [example for example in examples if len(example[2])]
    if not usable:
        raise BadInput("signatures", "no example raised an alarm", "give examples of faults that the detector sees")
    features = np.vstack([rows for _, _, rows in usable])
    faults = np.concatenate([np.full(len(rows), fault) for fault, _, rows in usable])
    names = [name for _, name, rows in usable for _ in range(len(rows))]
    runs = np.unique(names, return_inverse=True)[1]
    within = np.vstack([rows - rows.mean(axis=0) for _, _, rows in usable])
    deviation = np.sqrt(np.mean(within**2, axis=0) + _FLOOR**2)
    known = np.unique(faults)
    groups = _groups(known, _confusion(features / deviation, faults, runs, known))
    return Diagnosis(features, faults, deviation, groups)


def _confusion(features: Array, faults: Integers, runs: Integers, known: Integers) -> Array:
    """Share of the features of a fault (rows) named as each (columns), every run judged by all others."""
    table = np.zeros((len(known), len(known)))
    for run in np.unique(runs):
        mine = runs == run
        apart = _apart(features[mine], features[~mine])
        others = faults[~mine]
        near = np.column_stack([
            _nearest(apart[:, others == fault]) if (others == fault).any() else np.full(mine.sum(), np.inf)
            for fault in known
        ])  # fmt: skip
        row = int(np.searchsorted(known, faults[mine][0]))
        table[row] += np.bincount(near.argmin(axis=1), minlength=len(known)) / mine.sum()
    return table / np.maximum(table.sum(axis=1, keepdims=True), 1.0)


def _groups(known: Integers, confusion: Array) -> dict[int, int]:
    """Faults joined where either is taken for the other too often."""
    number = np.arange(len(known))
    for i in range(len(known)):
        for j in range(len(known)):
            if i != j and confusion[i, j] >= _CONFUSED:
                number[number == number[j]] = number[i]
    return {int(fault): int(one) for fault, one in zip(known, number, strict=True)}


def _apart(some: Array, others: Array) -> Array:
    """Mean square differences (n, m)."""
    cross = some @ others.T
    return ((some**2).sum(axis=1)[:, None] + (others**2).sum(axis=1)[None] - 2 * cross) / some.shape[1]


def _nearest(apart: Array) -> Array:
    """Mean of the smallest distances (n,) of (n, m)."""
    count = min(_NEAREST, apart.shape[1])
    return np.asarray(np.partition(apart, count - 1, axis=1)[:, :count].mean(axis=1), np.float64)
