"""Calibrates the answer of `bristle assess` on simulated loops: writes identification/loops/calibration.py.

    python -m studies.loop_calibration --seeds 1000 1400

Loops are as historians keep them. The evidence is weighed by multinomial logistic regression with a ridge, for
integrating and other processes apart, and for data that hide the shape of signals. From which probability on the answer
is `stiction` or `no_stiction`, and how wide intervals are, is chosen by cross-validation on the same seeds. How wide
those of friction in newtons are is told by stems without a positioner, of as many seeds that follow.
"""

from __future__ import annotations

import argparse
import textwrap
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.optimize import minimize

import identification.loops
from identification.loops import (
    CAUSES,
    LOOP_KINDS,
    CalibrationTable,
    LoopFindings,
    SimulatedLoop,
    as_kept,
    error_of,
    loop_findings,
    of_search,
    process_gain,
    simulated_loop,
    table_of,
    weighed_by,
)
from recordings import Array, Progress, silent
from studies.sticky_loops import hidden_by_positioner

RIDGE = 2.0
FOLDS = 6
FALSE_STICTION, FALSE_NO_STICTION = 0.015, 0.05
"""Shares of other loops called `stiction`, and of loops that feel their sticky valve called `no_stiction`, that
cross-validation may have."""
HEAD = '''"""What the evidence weighs: written by `python -m studies.loop_calibration --seeds {first} {last}`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import nan as NAN

CAUSES_TOLD = {causes}
CERTAIN, UNLIKELY = {certain:.2f}, {unlikely:.2f}
"""Probabilities from which on the answer is `stiction`, and up to which it is `no_stiction`."""


@dataclass(frozen=True)
class CalibrationTable:
    """mean, spread (k,) : of the evidence, as in `evidence.NAMES`; weights (causes, 1 + k), constant first."""

    mean: tuple[float, ...]
    spread: tuple[float, ...]
    weights: tuple[tuple[float, ...], ...]


# fmt: off
TABLES: Mapping[str, CalibrationTable] = {{
{tables}}}

ERRORS: tuple[tuple[float, float, float, float], ...] = (
{errors})
"""What was off in sticky loops that were found, as of `amounts.error_of`."""

STEM_ERRORS: tuple[tuple[float, float, float, float], ...] = (
{stem_errors})
"""The same of stems on a spring without a positioner, of seeds {last} to {after}."""
'''


@dataclass(frozen=True)
class Seen:
    """A loop whose cause is known. evidence (k,); whole : whether the data show the shape of the signals; cause : its
    place in `CAUSES`; felt : whether the valve sticks and no positioner hides it; error (4,) : as of `error_of`, for
    sticky valves without a positioner, as there is no S of OP behind one."""

    seed: int
    integrating: bool
    evidence: Array
    whole: bool
    cause: int
    felt: bool
    error: Array | None

    @property
    def table(self) -> str:
        """The table that judges it."""
        return table_of(self.integrating, self.whole)


def collected(first: int, last: int, progress: Progress = silent) -> list[Seen]:
    """The evidence of the seeds from `first` to before `last`, as far as the data carry an answer."""
    found = []
    for seed in range(first, last):
        known = simulated_loop(seed)
        seen = loop_findings(as_kept(known.loop, seed)[0])
        progress("loops", seed - first + 1, last - first)
        if seen is not None:
            cause = CAUSES.index(known.cause)
            sticky = known.cause == "stiction"
            error = _error(known, seen) if sticky and known.valve != "positioned" else None
            felt = sticky and not hidden_by_positioner(known)
            found.append(Seen(seed, known.loop.integrating, seen.weights, seen.whole, cause, felt, error))
    return found


def _error(known: SimulatedLoop, seen: LoopFindings) -> Array:
    """The error of S, J and the process gain of a sticky loop."""
    gain = np.nan if known.loop.integrating else process_gain(seen.loop, seen.period, *seen.tried.best)
    return error_of(seen.tried, known.s, known.j, known.gain / gain if gain > 0 else np.nan)


def tables_of(seen: Sequence[Seen]) -> dict[str, CalibrationTable]:
    """All tables, each from the loops that it judges; that of the search alone from all of them."""
    rows: dict[str, list[tuple[Array, int]]] = {table_of(True, True): [], table_of(False, True): []}
    for one in seen:
        rows.setdefault(table_of(False, False), []).append((of_search(one.evidence), one.cause))
        if one.whole:
            rows[one.table].append((one.evidence, one.cause))
    return {kind: fitted(*map(np.array, zip(*some, strict=True))) for kind, some in rows.items()}


def fitted(evidence: Array, cause: Array) -> CalibrationTable:
    """The table of evidence (n, k) whose causes are known, as numbers (n,)."""
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
    weights = found.x.reshape(len(CAUSES), -1)
    return CalibrationTable(tuple(mean), tuple(spread), tuple(map(tuple, weights)))


def cross_validated(seen: Sequence[Seen]) -> Array:
    """The probability of stiction (n,) of loops by tables that have not seen them."""
    chance = np.empty(len(seen))
    for fold in range(FOLDS):
        tables = tables_of([one for i, one in enumerate(seen) if i % FOLDS != fold])
        for i in range(fold, len(seen), FOLDS):
            chance[i] = weighed_by(tables[seen[i].table], seen[i].evidence)[0]
    return chance


def limits_of(seen: Sequence[Seen], chance: Array) -> tuple[float, float]:
    """From which probability on the answer is `stiction`, and up to which `no_stiction`: the least and the most that
    keep the allowed shares of false answers."""
    sticky, felt = np.array([one.cause == 0 for one in seen]), np.array([one.felt and one.whole for one in seen])
    steps = np.arange(0.05, 0.96, 0.01)
    certain = [p for p in steps if p >= 0.5 and np.mean(chance[~sticky] >= p) <= FALSE_STICTION]
    unlikely = [p for p in steps if p <= 0.5 and np.mean(chance[felt] <= p) <= FALSE_NO_STICTION]
    return min(certain, default=0.95), max(unlikely, default=0.05)


def errors(seen: Sequence[Seen], chance: Array, certain: float) -> list[Array]:
    """The errors of the sticky loops that are found."""
    return [one.error for one, p in zip(seen, chance, strict=True) if one.error is not None and p >= certain]


def stem_errors(
    first: int, last: int, tables: dict[str, CalibrationTable], certain: float, progress: Progress = silent
) -> list[Array]:
    """The errors of the stems that are found."""
    found = []
    for seed in range(first, last):
        known = simulated_loop(seed, "stiction", LOOP_KINDS[seed % len(LOOP_KINDS)], "stem")
        seen = loop_findings(as_kept(known.loop, seed)[0])
        progress("stems", seed - first + 1, last - first)
        if seen is not None:
            table = tables[table_of(known.loop.integrating, seen.whole)]
            if weighed_by(table, seen.weights)[0] >= certain:
                found.append(_error(known, seen))
    return found


def module(first: int, last: int, seen: Sequence[Seen], progress: Progress = silent) -> str:
    """The text of the calibration module."""
    tables, fitted_tables = "", tables_of(seen)
    for kind, one in fitted_tables.items():
        rows = "\n".join(_numbers(row, 12) for row in one.weights)
        tables += f'    "{kind}": CalibrationTable(\n{_numbers(one.mean, 8)}\n{_numbers(one.spread, 8)}\n'
        tables += f"        (\n{rows}\n        ),\n    ),\n"
    causes = "(" + ", ".join(f'"{one}"' for one in CAUSES) + ")"
    chance = cross_validated(seen)
    certain, unlikely = limits_of(seen, chance)
    after = 2 * last - first
    stems = stem_errors(last, after, fitted_tables, certain, progress)
    return HEAD.format(
        first=first, last=last, after=after - 1, stem_errors=_rows(stems),
        causes=causes, certain=certain, unlikely=unlikely, tables=tables,
        errors=_rows(errors(seen, chance, certain)),
    )  # fmt: skip


def _rows(some: Sequence[Array]) -> str:
    return "".join(f"{_numbers(row, 4)}\n" for row in some)


def _numbers(values: Sequence[float], indent: int) -> str:
    text = "(" + ", ".join(f"{value:.4g}".replace("nan", "NAN") for value in values) + "),"
    return textwrap.fill(text, 118, initial_indent=" " * indent, subsequent_indent=" " * (indent + 1))


def main() -> None:
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", nargs=2, type=int, default=(1000, 1400))
    first, last = parser.parse_args().seeds

    def told(what: str, done: int, total: int) -> None:
        if done % 50 == 0:
            print(f"{done} of {total} {what}", flush=True)

    seen = collected(first, last, told)
    place = Path(identification.loops.__path__[0]) / "calibration.py"
    place.write_text(module(first, last, seen, told), encoding="utf-8")
    print(f"{len(seen)} of {last - first} loops carry an answer; written: {place}")


if __name__ == "__main__":
    main()
