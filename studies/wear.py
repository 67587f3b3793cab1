"""How often the intervals of `bristle follow` hold, on seeded wear: `python -m studies.wear --seeds 0 100`.

The level of a quantity rises at a steady rate and wanders; recordings come at irregular dates and scatter by more than
they know of themselves. The truth goes on after the last recording until it crosses the limit. Development seeds are
0 to 99; the figures of the documentation are of seeds from 1000 on.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass

import numpy as np

from identification.following import TrendBelief, crossing


@dataclass(frozen=True)
class WearCase:
    """slope : true, in a day; day : true day of crossing after the last recording, infinite within ten years where it
    is not; belief : after all recordings; limit, started : as of `crossing`.
    """

    slope: float
    day: float
    belief: TrendBelief
    limit: float
    started: float


def worn(seed: int) -> WearCase:
    """The wear of a seed: 12 to 40 recordings over 100 to 500 days."""
    rng = np.random.default_rng([seed, 27])
    started, limit = 100.0, 160.0
    slope = float(rng.uniform(0.02, 0.2))
    wander, scatter = float(10 ** rng.uniform(-2, -0.3)), float(10 ** rng.uniform(-0.5, 0.7))
    dates = np.sort(rng.choice(int(rng.integers(100, 500)), int(rng.integers(12, 40)), replace=False))
    days = np.arange(4000)
    level = started + slope * days + np.cumsum(rng.normal(0, wander, len(days)))
    belief = None
    for day in dates:
        std = float(rng.uniform(0.5, 2.0))
        value = float(level[day] + rng.normal(0, np.hypot(std, scatter)))
        belief = TrendBelief.first(day, value, std) if belief is None else belief.seen(day, value, std)
    assert belief is not None
    beyond = np.flatnonzero(level[dates[-1] :] >= limit)
    return WearCase(slope, float(beyond[0]) if len(beyond) else float("inf"), belief, limit, started)


def held(seeds: range) -> tuple[int, int, int, list[float]]:
    """How often the intervals of the date and of the slope held, of how many, and widths over the true time to go."""
    dates = slopes = cases = 0
    widths = []
    for seed in seeds:
        case = worn(seed)
        if case.day <= 0 or case.belief.mean[case.belief.share.argmax(), 0] >= case.limit:
            continue
        met = crossing(case.belief, case.limit, case.started)
        lower, upper = (np.inf if one is None else one for one in met.days[1:])
        dates += bool(lower - 1 <= case.day <= upper + 1)
        drawn = case.belief.drawn(4000, np.random.default_rng(seed))[1]
        slopes += bool(np.quantile(drawn, 0.025) <= case.slope <= np.quantile(drawn, 0.975))
        cases += 1
        widths.append((min(upper, 3653.0) - lower) / case.day)
    return dates, slopes, cases, widths


def main() -> None:
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", nargs=2, type=int, default=(0, 40))
    dates, slopes, cases, widths = held(range(*parser.parse_args().seeds))
    print(f"the date is within its 95 % interval in {dates} of {cases} cases, the slope in {slopes}")
    print(f"median width of the interval over the true time to go: {np.median(widths):.2f}")


if __name__ == "__main__":
    main()
