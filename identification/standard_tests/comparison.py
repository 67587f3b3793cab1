"""A test against a reference test: what changed beyond the noise of both."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from scipy.stats import norm

FALSE = 0.05
"""Chance that any of the quantities is called changed although none is, where their errors are independent."""


def changes(before: Mapping[str, Any], after: Mapping[str, Any]) -> list[dict[str, Any]]:
    """The quantities of two `values` (as in `test.json`) whose difference is more than the noise of both.

    Half widths of 95 % intervals add in squares; the limit grows with the number of quantities (Bonferroni).
    """
    first, second = dict(_quantities(before)), dict(_quantities(after))
    common = [name for name in second if name in first]
    stricter = float(norm.isf(FALSE / (2 * max(1, len(common)))) / norm.isf(0.025))
    found = []
    for name in common:
        old, new = first[name], second[name]
        difference = new["value"] - old["value"]
        towards = (old["upper"] - old["value"], new["value"] - new["lower"])
        away = (old["value"] - old["lower"], new["upper"] - new["value"])
        limit = stricter * float(np.hypot(*(towards if difference > 0 else away)))
        if abs(difference) > max(limit, 1e-9 * abs(old["value"])):
            found.append({"name": name, "before": old, "after": new, "difference": difference, "limit": limit})
    return found


def _quantities(values: Mapping[str, Any]) -> Iterator[tuple[str, dict[str, float]]]:
    """Every quantity with an interval, by a name that both tests have; steps go by their ends."""
    for name, value in values.items():
        if isinstance(value, Mapping) and {"value", "lower", "upper"} <= set(value):
            yield name, dict(value)
        elif name == "bench_set_kPa" and len(value) == 2:
            yield from zip(("bench_set_kPa low", "bench_set_kPa high"), map(dict, value), strict=True)
