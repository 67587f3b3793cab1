"""A Takagi-Sugeno bank: linear observers of local models, their outputs fused by fuzzy memberships (3.2.2, fuzzy)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from detector.generators.contract import Generator
from detector.generators.innovation_form import observer_form, regressors
from detector.generators.luenberger import Luenberger, full_order
from recordings import Array, BadInput

_PULL = 1e-2
"""Weight of the model of all readings in that of a region: where a region has hardly any, it says nothing else."""


@dataclass(frozen=True, eq=False)
class TakagiSugeno(Generator):
    """(y^ - y) / deviation, y^ = sum over i of h_i(p) y^_i: each local observer sees all readings all the time.

    observers : of local affine models, whose inputs are those of the bank and 1; centres (n_models,), rising : of the
    triangular memberships h_i, which add up to one, in the premise p, the input of number `premise`; deviation (m,).
    A premise that is an input cannot be moved by a fault of a sensor.
    """

    observers: tuple[Luenberger, ...]
    centres: Array
    premise: int
    deviation: Array

    @property
    def width(self) -> tuple[int, int, int]:
        """As many residuals as outputs."""
        inputs, outputs, residuals = self.observers[0].width
        return inputs - 1, outputs, residuals

    def initial(self) -> Array:
        """Every observer at its own start."""
        return np.concatenate([one.initial() for one in self.observers])

    def memberships(self, premise: Array) -> Array:
        """h (n, n_models) of a premise (n,)."""
        return memberships(premise, self.centres)

    def _advance(self, state: Array, u: Array, y: Array) -> tuple[Array, Array]:
        joined, h = np.column_stack([u, np.ones(len(u))]), self.memberships(u[:, self.premise])
        parts, fused = np.split(state, len(self.observers)), np.zeros_like(y)
        for i, (one, part) in enumerate(zip(self.observers, parts, strict=True)):
            parts[i], residual = one.run(part, joined, y)
            fused += h[:, [i]] * residual
        return np.concatenate(parts), fused / self.deviation


def memberships(premise: Array, centres: Array) -> Array:
    """Triangles (n, n_centres) over rising centres, the outer ones going on for ever; each row adds up to one.

    >>> memberships(np.array([-1.0, 0.25, 1.0]), np.array([0.0, 1.0])).tolist()
    [[1.0, 0.0], [0.75, 0.25], [0.0, 1.0]]
    """
    return np.column_stack([np.interp(premise, centres, one) for one in np.eye(len(centres))])


def learn_takagi_sugeno(
    u: Array, y: Array, *, premise: int = 0, models: int = 5, depth: int = 3, poles: tuple[float, float] = (0.3, 0.6)
) -> TakagiSugeno:
    """Local models by weighted least squares on fault-free rows u (n, r), y (n, m), centres where readings are.

    poles : range of the observers'. Raises BadInput for a premise that hardly varies, or too few readings.
    """
    centres = np.unique(np.quantile(u[:, premise], np.linspace(0.0, 1.0, models)))
    m, joined = y.shape[1], np.column_stack([u, np.ones(len(u))])
    rows = regressors(joined, y, depth)
    if len(centres) < models or len(rows) < 5 * rows.shape[1] * models:
        found = f"{len(y)} readings, {len(centres)} different quantiles of the premise"
        raise BadInput("Takagi-Sugeno bank", found, f"give more than {5 * rows.shape[1] * models}, or fewer models")
    target, h = y[depth:], memberships(u[depth:, premise], centres)
    pull = _PULL * rows.T @ rows
    usual = np.linalg.lstsq(rows, target, rcond=None)[0]
    observers = []
    for weight in h.T:
        weighed = rows * weight[:, None]
        matrix, right = weighed.T @ rows + pull, weighed.T @ target + pull @ usual
        solved = np.asarray(np.linalg.lstsq(matrix, right, rcond=None)[0], np.float64)
        plant, _ = observer_form(solved, depth, joined.shape[1], m)
        observers.append(full_order(plant, np.linspace(*poles, plant.order)))
    blank = TakagiSugeno(tuple(observers), centres, premise, np.ones(m))
    usual_size = np.std(blank.run(blank.initial(), u, y)[1][100:], axis=0)
    return TakagiSugeno(blank.observers, centres, premise, np.maximum(usual_size, 1e-12))
