"""Structured residual sets by parity relations: each blind to some faults by construction, and what they tell apart."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from detector.generators.contract import Generator
from detector.generators.parity import Parity, null_rows, temporal
from detector.generators.plant import LinearPlant
from recordings import Array, BadInput

_EXACT = 1e-8


@dataclass(frozen=True, eq=False)
class StructuredSet(Generator):
    """One residual for each wish, all from the same readings; blind : faults that each is decoupled from, exactly.

    relations : parity relations whose rows V are the residuals, each of unit length.
    """

    relations: Parity
    blind: tuple[tuple[int, ...], ...]

    @property
    def width(self) -> tuple[int, int, int]:
        """See `Generator.width`."""
        return self.relations.width

    def initial(self) -> Array:
        """No readings yet."""
        return self.relations.initial()

    def isolability(self) -> NDArray[np.bool_]:
        """Whether a residual sees a fault (n_residuals, n_faults), from the model alone: (3.19) row by row."""
        parts = np.abs(self.relations.V @ self.relations.M)
        faults = parts.shape[1] // (self.relations.depth + 1)
        seen = parts.reshape(len(parts), self.relations.depth + 1, faults).max(axis=1)
        found: NDArray[np.bool_] = seen > _EXACT * max(1.0, float(np.abs(self.relations.M).max(initial=0.0)))
        return found

    def _advance(self, state: Array, u: Array, y: Array) -> tuple[Array, Array]:
        return self.relations.run(state, u, y)[0:2]


def structured(plant: LinearPlant, blind: Sequence[Sequence[int]], depth: int | None = None) -> StructuredSet:
    """For each wish a relation v with v W = 0 and v M_j = 0 for all faults j that it is to be blind to; of all such v
    the one that sees constant other faults best. depth : steps back, the order of the plant where not given.

    Raises BadInput for a wish that no relation fulfils while it sees another fault.
    """
    depth = plant.order if depth is None else depth
    every = temporal(plant, depth)
    rows = [_row(every, plant, one) for one in blind]
    return StructuredSet(
        Parity(np.vstack(rows), every.H, every.M, depth, every.sizes), tuple(tuple(one) for one in blind)
    )


def one_each(faults: int) -> tuple[tuple[int, ...], ...]:
    """The wishes of a dedicated set: residual i sees fault i and no other. It needs as many outputs as faults."""
    return tuple(tuple(j for j in range(faults) if j != i) for i in range(faults))


def all_but_one(faults: int) -> tuple[tuple[int, ...], ...]:
    """The wishes of a generalised set: residual i sees all faults but i. An output more than one may be enough."""
    return tuple((i,) for i in range(faults))


def isolates(table: NDArray[np.bool_]) -> Literal["no", "weakly", "strongly"]:
    """How an isolability table (n_residuals, n_faults) tells faults apart: weakly, no two columns are equal and none is
    empty; strongly, no column turns into another when the residuals of one fault miss it, either.

    >>> isolates(np.array([[True, False], [True, True]])), isolates(np.eye(2, dtype=bool))
    ('weakly', 'strongly')
    """
    columns = table.T
    pairs = [(one, other) for i, one in enumerate(columns) for j, other in enumerate(columns) if i != j]
    if not columns.any(axis=1).all() or any((one == other).all() for one, other in pairs):
        return "no"
    return "weakly" if any((one <= other).all() for one, other in pairs) else "strongly"


def _row(every: Parity, plant: LinearPlant, blind: Sequence[int]) -> Array:
    faults = plant.sizes[2]
    columns = [k * faults + j for k in range(every.depth + 1) for j in blind]
    free = null_rows(every.V @ every.M[:, columns]) @ every.V if columns else every.V
    seen = free @ every.M
    if not len(free) or np.abs(seen).max(initial=0.0) < _EXACT * max(1.0, float(np.abs(every.M).max())):
        found = f"no relation over {every.depth} steps is blind to {', '.join(map(str, blind))} and sees another fault"
        raise BadInput("structured residuals", found, "wish for fewer at once, or measure one output more")
    constant = seen @ np.tile(np.eye(faults), (every.depth + 1, 1))
    strongest = np.linalg.svd(constant if np.abs(constant).max() > _EXACT else seen)[0][:, 0]
    return np.asarray(strongest @ free, np.float64)[None]
