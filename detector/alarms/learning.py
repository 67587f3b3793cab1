"""Several residuals of a valve, learned under one promise."""

from __future__ import annotations

from collections.abc import Mapping

from detector.alarms.healthy import LEAST_BLOCKS, Healthy, learn_residual
from detector.alarms.promise import Promise, words
from detector.alarms.service import Evidence
from recordings import Array, BadInput


def learn_evidence(
    residuals: Mapping[str, Array], dt_s: float, wish_s: float, shares: Mapping[str, float] | None = None
) -> Evidence:
    """Residuals by name, each (n_samples,), dt_s [s] apart, without a fault.

    wish_s : the mean time between false alarms that is wished [s]; shares : of the rate, equal ones without it. A
    residual that cannot be learned is left out, with the reason. Raises BadInput when that leaves none.
    """
    healthy, refusals = dict[str, Healthy](), list[BadInput]()
    for name, values in residuals.items():
        try:
            healthy[name] = learn_residual(values, dt_s, name)
        except BadInput as refusal:
            refusals.append(refusal)
    if not healthy:
        raise refusals[0]
    found = [finding for one in healthy.values() for finding in one.findings]
    given = shares or dict.fromkeys(healthy, 1.0)
    whole = sum(given[name] for name in healthy)
    promise = Promise.of(min(one.seconds for one in healthy.values()), wish_s, tuple(dict.fromkeys(found)))
    parts = tuple(given[name] / whole for name in healthy)
    notes = [f"{one.where} left out: {one.found}; {one.remedy}" for one in refusals]
    notes += [
        f"{name}: {words(one.seconds)} are fewer than {LEAST_BLOCKS} independent blocks, so that only gross residuals "
        f"are judged; learn from {words(one.needed_s)} to judge small ones"
        for name, one in healthy.items()
        if one.only_gross
    ]
    return Evidence(tuple(healthy.values()), tuple(healthy), parts, promise, tuple(notes))
