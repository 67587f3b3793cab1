"""Calibrates the answer of `bristle assess` on simulated loops, and judges it on others.

    python -m studies.loop_calibration --fit 1000 1400    prints the module identification/loops/calibration.py
    python -m studies.loop_calibration --judge 5000 5200  prints how often the answers are right

With `--kept` two loops of five are kept by a historian that rounds or compresses them. The evidence is fitted by
multinomial logistic regression with a ridge, for integrating and other processes apart.
"""

from __future__ import annotations

import argparse
from collections import Counter
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from scipy.optimize import minimize

from identification.loops import (
    CAUSES,
    Assessment,
    SimulatedLoop,
    as_kept,
    assess_loop,
    loop_evidence,
    of_search,
    simulated_loop,
    table_of,
)
from recordings import Array

RIDGE = 0.5
HEAD = '''"""What the evidence weighs, fitted to simulated loops of known cause by `studies/loop_calibration.py`.

Seeds {first} to {last} of `simulated_loop`; the answers are judged on seeds from 5000 on.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

CAUSES_TOLD = {causes}


@dataclass(frozen=True)
class CalibrationTable:
    """mean, spread (k,) : of the evidence, as in `evidence.NAMES`; weights (causes, 1 + k), constant first."""

    mean: tuple[float, ...]
    spread: tuple[float, ...]
    weights: tuple[tuple[float, ...], ...]


TABLES: Mapping[str, CalibrationTable] = {{
{tables}}}
'''


def fitted(evidence: Array, cause: Array) -> tuple[Array, Array, Array]:
    """Mean and spread (k,) of the evidence (n, k), and weights (causes, 1 + k) for causes given as numbers (n,)."""
    known = np.isfinite(evidence)
    count = np.maximum(known.sum(axis=0), 1)
    mean = np.where(known, evidence, 0.0).sum(axis=0) / count
    spread = np.sqrt(np.where(known, (evidence - mean) ** 2, 0.0).sum(axis=0) / count)
    spread[spread < 1e-6] = 1.0
    scaled = np.nan_to_num(np.clip((evidence - mean) / spread, -3, 3))
    design, truth = np.column_stack([np.ones(len(scaled)), scaled]), np.eye(len(CAUSES))[cause]
    ridge = np.array([0.02, *[RIDGE] * scaled.shape[1]])

    def loss(flat: Array) -> tuple[float, Array]:
        weights = flat.reshape(len(CAUSES), -1)
        scores = design @ weights.T
        odds = np.exp(scores - scores.max(axis=1, keepdims=True))
        chance = odds / odds.sum(axis=1, keepdims=True)
        value = -np.sum(truth * np.log(chance + 1e-300)) + np.sum(ridge * weights**2) / 2
        return float(value), ((chance - truth).T @ design + ridge * weights).ravel()

    found = minimize(loss, np.zeros(len(CAUSES) * design.shape[1]), jac=True, method="L-BFGS-B")
    return mean, spread, found.x.reshape(len(CAUSES), -1)


Loops = Callable[[int], SimulatedLoop]
"""The loop of a seed."""


def kept(seed: int) -> SimulatedLoop:
    """The simulated loop of a seed as its historian keeps it."""
    known = simulated_loop(seed)
    return replace(known, loop=as_kept(known.loop, seed))


def module(first: int, last: int, loops: Loops = simulated_loop) -> str:
    """The text of the calibration module for the seeds from `first` to before `last`."""
    rows: dict[str, list[tuple[Array, int]]] = {"integrating": [], "self-regulating": [], "search alone": []}
    for seed in range(first, last):
        known = loops(seed)
        found = loop_evidence(known.loop)
        if found is None:
            continue
        weights, whole = found
        cause = CAUSES.index(known.cause)
        rows["search alone"].append((of_search(weights), cause))
        if whole:
            rows[table_of(known.loop.integrating, whole)].append((weights, cause))
    tables = ""
    for kind, some in rows.items():
        mean, spread, weights = fitted(np.array([one for one, _ in some]), np.array([cause for _, cause in some]))
        inner = "".join(f"            {_numbers(row)},\n" for row in weights)
        tables += f'    "{kind}": CalibrationTable(\n        {_numbers(mean)},\n'
        tables += f"        {_numbers(spread)},\n        (\n{inner}        ),\n    ),\n"
    causes = "(" + ", ".join(f'"{one}"' for one in CAUSES) + ")"
    return HEAD.format(first=first, last=last - 1, causes=causes, tables=tables)


def _numbers(values: Array) -> str:
    return "(" + ", ".join(f"{value:.4g}" for value in values) + ")"


def judged(first: int, last: int, loops: Loops = simulated_loop) -> str:
    """How often the answers for the seeds are right, in lines."""
    pairs = [(known, assess_loop(known.loop)) for known in map(loops, range(first, last))]
    table = Counter((known.cause, found.verdict) for known, found in pairs)
    lines = [f"{cause:12} {verdict:12} {count}" for (cause, verdict), count in sorted(table.items())]
    clear = [found for known, found in pairs if known.cause == "stiction" and known.j > 2 * known.noise]
    lines.append(f"J above two noise sigmas: {_share(clear, 'stiction')} found")
    for words, some in _by_data(clear).items():
        lines.append(f"  {words}: {_share(some, 'stiction')} found")
    others = [found for known, found in pairs if known.cause != "stiction"]
    lines.append(f"no stiction: {_share(others, 'stiction')} called stiction")
    return "\n".join([*lines, *_amounts(pairs)])


def _by_data(found: list[Assessment]) -> dict[str, list[Assessment]]:
    """Assessments by what the data hide."""
    sorted_out: dict[str, list[Assessment]] = {"nothing hidden": [], "shape hidden": [], "everything hidden": []}
    for one in found:
        hidden = {problem.hides for problem in one.problems}
        key = "everything" if "everything" in hidden else "shape" if "shape" in hidden else "nothing"
        sorted_out[f"{key} hidden"].append(one)
    return sorted_out


def _share(found: list[Assessment], verdict: str) -> str:
    return f"{sum(one.verdict == verdict for one in found)} of {len(found)}"


def _amounts(pairs: list[tuple[SimulatedLoop, Assessment]]) -> list[str]:
    right = [(known, found.amount) for known, found in pairs if found.amount and known.cause == "stiction"]
    s = sum(amount.s.lower <= known.s <= amount.s.upper for known, amount in right)
    j = sum(amount.j.lower <= known.j <= amount.j.upper for known, amount in right)
    return [f"S within its interval in {s} of {len(right)}, J in {j}"]


def main() -> None:
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--fit", nargs=2, type=int)
    parser.add_argument("--judge", nargs=2, type=int)
    parser.add_argument("--kept", action="store_true", help="loops as historians keep them")
    given = parser.parse_args()
    loops = kept if given.kept else simulated_loop
    if given.fit:
        print(module(given.fit[0], given.fit[1], loops), end="")
    if given.judge:
        print(judged(given.judge[0], given.judge[1], loops))


if __name__ == "__main__":
    main()
