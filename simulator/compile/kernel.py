"""A valve's effects, ready to run: parameters by name in, position (or force) and its derivatives out."""

from __future__ import annotations

import functools
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from recordings import Array, BadInput
from simulator.compile.c_compiler import compiler
from simulator.compile.scan import Run, Scan, Scanner, Shots
from simulator.compile.step import (
    VectorLayout,
    force_driven,
    force_driven_damped,
    force_with_error,
    force_with_error_damped,
    motion_driven,
)
from simulator.delay import delay_columns
from simulator.effect import Catalogue, Effect, Memory, Site
from simulator.effects import CATALOGUE

Causality = Literal["force", "motion"]
"""What drives a valve: the force, which gives the position, or an imposed motion, which gives the force."""

KernelCausality = Literal["force", "motion", "force with error"]
"""The same of a kernel, which may also take the force for recorded with an error, and estimate it."""


@dataclass(frozen=True)
class Kernel:
    """The compiled physics of a set of effects.

    parameters : full names, in the order of the parameter vector and of the first columns of a jacobian;
    states : names of the states, in the order of the last columns; a force-driven kernel starts with x and v;
    catalogue : where its effects were looked up, and where to look up what they declare.
    """

    effects: tuple[str, ...]
    causality: KernelCausality
    layout: VectorLayout
    scanner: Scanner
    catalogue: Catalogue = CATALOGUE
    damped: bool = False

    @property
    def parameters(self) -> tuple[str, ...]:
        """Full names of the parameters, in order."""
        return self.layout.parameters

    @property
    def states(self) -> tuple[str, ...]:
        """Names of the states, in order."""
        return self.layout.states

    def vector(self, values: Mapping[str, float]) -> Array:
        """The parameter vector for values by name. Raises KeyError naming a parameter that is missing."""
        missing = [name for name in self.parameters if name not in values]
        if missing:
            raise KeyError(f"no value for {missing[0]}")
        return np.array([values[name] for name in self.parameters], float)

    def start(self, position: float = 0.0, velocity: float = 0.0, force: float = 0.0) -> Array:
        """Initial state at a position [m], velocity [m/s] and actuating force [N], all memory at its own start."""

        def first(memory: Memory) -> float:
            return position if memory.at_position else force if memory.at_force else memory.start

        memory = [first(m) for m in self.layout.memory]
        return np.array(memory if self.causality == "motion" else [position, velocity, *memory], float)

    def run(
        self,
        t: Array,
        u: Array,
        p: Array,
        s0: Array,
        *,
        h_max: float = 0.0,
        hold: bool = False,
        sensitivities: bool = False,
        resets: Array | None = None,
    ) -> Scan:
        """As `Scanner.run`: t (n_samples) [s]; u (n_samples) [N], or (n_samples, 4) imposed: x, v, a and the load.

        u may also be what `inputs` returns.
        """
        given = self.inputs(t, u, p, hold=hold)
        return self.scanner.run(t, given, p, s0, h_max=h_max, hold=hold, sensitivities=sensitivities, resets=resets)

    def run_together(
        self, runs: Sequence[Run], p: Array, columns: tuple[int, ...], *, h_max: float = 0.0
    ) -> list[tuple[Array, Array]] | None:
        """As `Scanner.run_together`; u of each as for `run`."""
        given = [run._replace(u=self.inputs(run.t, run.u, p, hold=run.hold)) for run in runs]
        return self.scanner.run_together(given, p, columns, h_max=h_max)

    def shoot(
        self,
        t: Array,
        u: Array,
        p: Array,
        path: Array,
        *,
        h_max: float = 0.0,
        carry: Literal["nothing", "memory", "motion and memory"] = "nothing",
    ) -> Shots:
        """Every interval between samples on its own from a path (n_samples, n_states): `Scanner.shoot`.

        For a kernel of a force with error; u (n_samples) [N]: the force as it is known, which only a dead time reads.
        carry : run the memory of the effects along the path, or position and velocity as well under the force of the
        path, and write them there, instead.
        """
        columns, first = self.known_inputs(t, u, p), 2 if carry == "memory" else 0
        carried = np.array([i >= first and name not in ("u", "du") for i, name in enumerate(self.states)])
        return self.scanner.shoot(t, columns, p, path, h_max=h_max, carried=None if carry == "nothing" else carried)

    def known_inputs(self, t: Array, u: Array, p: Array) -> Array:
        """The inputs of a kernel of a force with error, (n_samples, 0), or with a dead time (n_samples, 2)."""
        return self.inputs(t, u, p)[:, 1:] if self.layout.delay else np.empty((len(t), 0))

    def inputs(self, t: Array, u: Array, p: Array, *, hold: bool = False) -> Array:
        """The inputs of the recurrence for a recorded force: u itself, and with a dead time in p what it was earlier.

        Run a part of a recording with the rows of it, and the force from before that part acts in it.
        """
        if not self.layout.delay or np.size(u) != np.size(t):
            return u
        t, u = np.asarray(t, float).reshape(-1), np.asarray(u, float).reshape(-1)
        tau = float(p[self.parameters.index(self.layout.delay)])
        return np.column_stack([u, delay_columns(t, u, tau, hold)])


def kernel(
    effects: Iterable[str],
    causality: KernelCausality = "force",
    catalogue: Catalogue = CATALOGUE,
    *,
    damped: bool = False,
) -> Kernel:
    """The kernel of some effects by id, compiled at its first use and kept for this process.

    causality : ``force`` simulates the position from the force, ``motion`` the force from an imposed motion,
    ``force with error`` has the force and its slope among the states, for estimating it along with the motion;
    catalogue : where the effects are looked up; `CATALOGUE.extended` makes one with effects of your own.
    Raises KeyError for an unknown id, BadInput for effects that do not fit the causality.

    >>> kernel(("inertia", "spring", "lugre")).parameters[:3]
    ('mass.m', 'spring.K', 'spring.F0')
    """
    chosen = catalogue.pick(tuple(effects))
    outside = [effect for effect in chosen if causality == "motion" and not shows_imposed(effect)]
    if outside or not chosen:
        found = f"{outside[0].id} acts on the {outside[0].site.value}, and the motion is imposed" if outside else "none"
        raise BadInput("effects", found, "name effects that act on the force, for example inertia, spring and lugre")
    return _kernel(chosen, causality, catalogue, compiler(), damped and causality != "motion")


def shows_imposed(effect: Effect) -> bool:
    """Whether an effect has a part in the force where the motion is imposed: a sensor has none, and a delay looks back
    in a force that is then the answer."""
    return effect.site is not Site.OUTPUT and not effect.delay


ASSEMBLED = {"force": force_driven, "motion": motion_driven, "force with error": force_with_error}

DAMPED = {"force": force_driven_damped, "force with error": force_with_error_damped}


@functools.lru_cache(maxsize=128)
def _kernel(
    effects: tuple[Effect, ...],
    causality: KernelCausality,
    catalogue: Catalogue,
    compiler: tuple[str, ...] | None,
    damped: bool,
) -> Kernel:
    """One kernel per choice of effects, catalogue and way of compiling."""
    return Kernel(
        tuple(e.id for e in effects), causality, *_assembled(effects, causality, compiler, damped), catalogue, damped
    )


@functools.lru_cache(maxsize=128)
def _assembled(
    effects: tuple[Effect, ...], causality: KernelCausality, _compiler: tuple[str, ...] | None, damped: bool
) -> tuple[VectorLayout, Scanner]:
    """The machine code of a choice of effects, which catalogues that extend one another share."""
    recurrence, layout = (DAMPED if damped else ASSEMBLED)[causality](effects)
    return layout, Scanner(recurrence)
