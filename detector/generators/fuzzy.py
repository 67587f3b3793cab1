"""Fuzzy evaluation of residuals: how far they are normal, and what the rules make of it (3.2.2)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np

from detector.generators.contract import Generator
from recordings import Array, BadInput

FuzzyTerm = Literal["negative", "normal", "positive", "off"]
"""``off`` : negative or positive."""


@dataclass(frozen=True)
class Fuzzy(Generator):
    """Truth of each conclusion, 0 to 1, from residuals (m).

    half (m,) : where a residual is half normal. Memberships are triangles: normal is 1 at 0 and 0 from 2 half on;
    negative and positive rise from 0 to 2 half. rules : terms by residual, for each conclusion; the lowest membership
    counts. `score` makes one number of all conclusions by their centre of gravity. Raises BadInput for a rule about
    a residual that is not there.

    >>> watch = Fuzzy((1.0, 1.0), {"leak": {0: "positive", 1: "normal"}})
    >>> watch.run(watch.initial(), np.zeros((1, 0)), [[1.5, 0.0]])[1].tolist()
    [[0.75]]
    """

    half: tuple[float, ...]
    rules: Mapping[str, Mapping[int, FuzzyTerm]]

    def __post_init__(self) -> None:
        for name, rule in self.rules.items():
            if not rule or not all(0 <= place < len(self.half) for place in rule):
                found = f"the rule '{name}' is about residuals {sorted(rule)}"
                raise BadInput("fuzzy rules", found, f"name some of 0 to {len(self.half) - 1}")

    @property
    def width(self) -> tuple[int, int, int]:
        """No inputs; outputs are residuals; one truth per conclusion."""
        return 0, len(self.half), len(self.rules)

    def initial(self) -> Array:
        """Nothing to remember."""
        return np.zeros(0)

    def memberships(self, residuals: Array) -> dict[FuzzyTerm, Array]:
        """Of each residual in each term, (n, m)."""
        share = residuals / (2 * np.array(self.half))
        rising, falling = np.clip(share, 0, 1), np.clip(-share, 0, 1)
        normal = np.clip(1 - np.abs(share), 0, 1)
        return {"negative": falling, "normal": normal, "positive": rising, "off": np.maximum(rising, falling)}

    def score(self, truths: Array, harm: Array) -> Array:
        """Centre of gravity (n,) of harms (n_conclusions,), 0 to 1, weighted by their truths; 0 when none holds."""
        total = truths.sum(axis=1)
        return np.divide(truths @ harm, total, out=np.zeros(len(truths)), where=total > 0) * np.minimum(1.0, total)

    def _advance(self, state: Array, u: Array, y: Array) -> tuple[Array, Array]:
        terms = self.memberships(y)
        truths = [
            np.min([terms[term][:, place] for place, term in rule.items()], axis=0) for rule in self.rules.values()
        ]
        return state, np.column_stack(truths)
