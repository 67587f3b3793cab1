"""One segment linearised along a path of its states, and what the measurements then say about path and parameters.

The states are those of a kernel of a force with error: position, velocity, the memory of the effects, the force and its
slope. Along the path every interval between samples has its own derivatives, so filter and smoother are linear: the
innovations, their variances and their derivatives by the parameters follow, and for any move of the parameters the
path that fits the measurements best (Bell, SIAM J. Optim. 4(3), 1994; Bryson and Frazier, 1963).
"""

from __future__ import annotations

import functools
from dataclasses import dataclass, replace
from importlib import resources
from types import ModuleType
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from identification.data.force import recursions_text
from identification.data.grid import Grid, Lead
from identification.estimators.coordinates import Coordinates
from identification.estimators.estimate import Innovations
from identification.estimators.noise_aware.compiled_pass import PathNoise, compiled_pass, run, way_back
from recordings import Array
from simulator import Kernel, native_module

NOISE_X, NOISE_V = 1e-8, 2e-5
"""Noise of the model itself per interval, position [m] and velocity [m/s]: below what can be measured, but enough for
the paths of very stiff bristles to settle."""
SUB_STEP, LEAD = 1e-3, 0.01
"""Longest sub-steps [s] of memory along a motion that is given, and before a part begins: there it has long to settle.
"""
BOTH: Final = "motion and memory"
"""What runs of the model carry on."""
FIRST_V, FIRST_SLOPE = 1e-4, 1e3
"""Standard deviations of the first velocity [m/s] and slope of the force [N/s]."""


UNKNOWN = 0.3
"""Standard deviation of the first state of a memory, as a share of what it can be."""
RUNAWAY = 0.3
"""Standard deviation [m/s] of a velocity from which it is held to that of the path, as in `recursions.py`."""


@dataclass(frozen=True)
class PathFreedom:
    """How much freedom the path has beside what the model says. force : factor on the standard deviations of the force;
    bristle : noise of the memory per interval, as a share of the break-away deflection fc/sigma0; curvature : share of
    an interval's present misfit that counts as its error of linearisation; h_max [s] largest sub-step; share : of the
    way to the smoothed path that is gone in one step (the whole way can diverge at break-aways); honest : an estimate's
    cost is what it would be without the allowance for linearisation. With it, costs of different parameters cannot be
    compared (a misfit buys its own excuse), but far from the end it guides better.
    """

    force: float = 1.0
    bristle: float = 1e-5
    curvature: float = 0.1
    h_max: float = 5e-4
    share: float = 0.6
    honest: bool = True


@functools.cache
def loops() -> ModuleType:
    """The compiled `filtered` and `smoothed` of `recursions.py`."""
    text = resources.files("identification.estimators.noise_aware").joinpath("recursions.py").read_text("utf-8")
    return native_module("smoother", recursions_text()[0] + text.partition("# The recursions\n")[2])


def correction(line: Innovations, move: Array | None = None, share: float = 1.0) -> Array:
    """Where the smoothed path lies (n, n_states) beside that of the linearisation, coordinates moved by (m,) or left
    where they are. share : fraction in [0, 1] of the step at unchanged coordinates; what `move` adds counts in full.
    """
    return smoothed(line, move, share)[0]


def pull_at_force(line: Innovations, t: Array, m: float) -> Array:
    """How strongly the measurements pull at a force on a mass m [kg] at the nodes t (n,) [s]: the gradient of half the
    squares by a force (n,) [1/N], each newton a push of its spacing. 0 where nothing is kept of the way back.
    """
    if not line.smoother:
        return np.zeros(len(t))
    return np.asarray(smoothed(line, adjoints=True)[1][:, 1] * np.gradient(t) / m, float)


def by_chance(line: Innovations, rng: np.random.Generator) -> Innovations:
    """Innovations as noise alone makes them, for the way back only; as they are where nothing is kept of that."""
    if not line.smoother:
        return line
    mean, P, S, E, V, *others = line.smoother
    noise = np.where(np.isfinite(V), np.sqrt(np.where(np.isfinite(V), V, 0.0)) * rng.standard_normal(V.shape), E)
    return replace(line, smoother=(mean, P, S, noise, V, *others))


def smoothed(
    line: Innovations, move: Array | None = None, share: float = 1.0, *, adjoints: bool = False
) -> tuple[Array, Array]:
    """The `correction` and, if asked for, the gradient of half the squares by the predicted states, (n, n_states), else
    (0, n_states).
    """
    if line.library is not None:
        return way_back(line.library, line.smoother, move, share, adjoints=adjoints)
    mean, P, S, E, V, J, K, H, F = line.smoother
    move = np.zeros(J.shape[2]) if move is None else np.ascontiguousarray(move, float)
    out, gradient = np.empty_like(mean), np.empty_like(mean)
    loops().smoothed(share * mean, P, S, share * E, V, J, K, H, F, move, out, gradient)
    return out, gradient if adjoints else gradient[:0]


def first_path(kernel: Kernel, grid: Grid, p: Array, h_max: float = SUB_STEP) -> Array | None:
    """A path (n, n_states) along the smoothed motion and force, on which the memory of the effects has run along: that
    of a part since before it began, for plays remember turns that are long past. Behind a sensor with memory the stem
    is not where it is read: there it is as far from that as the sensor, driven by the reading, is late.
    """
    value = dict(zip(kernel.parameters, p, strict=True))
    start = kernel.start(grid.motion[0, 0], 0.0, grid.force.u[0])
    path = np.zeros((len(grid.t), len(kernel.states)))
    path[:, : len(start)] = start
    path[:, 0] = grid.motion[:, 0]
    path[:, 1] = grid.motion[:, 2]  # noise on v would relax the bristle, and linearise rest as motion
    path[:, -2], path[:, -1] = grid.force.u, grid.force.slope
    deflection = max(value["lugre.fc"], value["lugre.fs"]) / value["lugre.sigma0"]  # a valve may rest near break-away
    held = grid.force.u[0] - value["spring.K"] * path[0, 0] - value["spring.F0"]
    path[0, kernel.states.index("lugre.z")] = np.clip(held / value["lugre.sigma0"], -deflection, deflection)
    before = None if grid.lead is None else _path_before(kernel, grid.lead, p)
    if before is not None:
        path[0, 2:-2] = before[2:-2]
    read = ran_along(kernel, grid.t, grid.force.u, p, path, h_max)
    if read is None:
        return None
    late = grid.motion[:, 0] - read
    if late.any():
        path[:, 0] += late
        read = ran_along(kernel, grid.t, grid.force.u, p, path, h_max)
    return None if read is None else path


def _path_before(kernel: Kernel, lead: Lead, p: Array) -> Array | None:
    """The state (n_states,) on a first path at the end of a lead; None where that has no solution. A thread makes the
    path of the whole grid at most once for all of its parts.
    """
    known, key = lead.whole.latest_path, p.tobytes()
    of, at, path = known.get("path", (None, b"", None))
    if of is not kernel or at != key:
        path = first_path(kernel, lead.whole, p, LEAD)
        known["path"] = kernel, key, path
    if path is None:  # it may have a solution up to the end of the lead
        path = first_path(kernel, lead.grid, p, LEAD)
    return None if path is None else np.asarray(path[lead.first], float)


def ran_along(
    kernel: Kernel, t: Array, u: Array, p: Array, path: Array, h_max: float = SUB_STEP,
    carry: Literal["memory", "motion and memory"] = "memory",
) -> Array | None:  # fmt: skip
    """Run the memory, or motion and memory, along a path (n, n_states) from its first state, under a force u (n,) [N],
    and write it there; the positions (n,) that are read then, None where it has no solution.
    """
    run = kernel.shoot(t, u, p, path, h_max=h_max, carry=carry)
    return run.outputs[:, 0] if run.failed is None and bool(np.isfinite(path).all()) else None


def linearise(
    kernel: Kernel, coordinates: Coordinates, grid: Grid, p: Array, path: Array, freedom: PathFreedom
) -> Innovations | None:
    """Filter a grid along a path at parameters p; None where the model has no solution."""
    library = compiled_pass(kernel, coordinates)
    if library is None:
        return linearise_in_parts(kernel, coordinates, grid, p, path, freedom)
    first, base = first_variances(kernel, grid, p, freedom, path), _noise_of_an_interval(kernel, p, freedom)
    noise = PathNoise(first, base, freedom.curvature, freedom.force**2, RUNAWAY)
    return run(library, kernel, coordinates, grid, p, path, freedom.h_max, noise, freedom.honest)


def linearise_in_parts(
    kernel: Kernel, coordinates: Coordinates, grid: Grid, p: Array, path: Array, freedom: PathFreedom
) -> Innovations | None:
    """As `linearise`, one array after the other, as it is done without a C compiler."""
    model = AffineModel.of(kernel, coordinates, grid, p, path, freedom.h_max)
    first = first_variances(kernel, grid, p, freedom, path)
    line = None if model is None else kalman_filter(kernel, grid, p, freedom, model, first)
    if model is None or line is None or not freedom.honest or freedom.curvature == 0.0:
        return line
    plain = kalman_filter(kernel, grid, p, replace(freedom, curvature=0.0), model.without_parameters(), first)
    return None if plain is None else replace(line, scored=plain.scored)


@dataclass(frozen=True)
class AffineModel:
    """The affine model of a grid along a path. E (n, 2): measured less predicted; H (n, 2, s), D (n, 2, m):
    derivatives of the predicted by state and coordinates; F (n - 1, s, s), G (n - 1, s, m): of the intervals; jump
    (n - 1, s): where an interval ends less where the next one starts.
    """

    E: Array
    H: Array
    D: Array
    F: Array
    G: Array
    jump: Array

    @classmethod
    def of(
        cls, kernel: Kernel, coordinates: Coordinates, grid: Grid, p: Array, path: Array, h_max: float
    ) -> AffineModel | None:
        shots = kernel.shoot(grid.t, grid.force.u, p, path, h_max=h_max)
        if shots.failed is not None:
            return None
        n, s, q, slope = len(grid.t), path.shape[1], len(p), coordinates.slope(p)
        E = np.column_stack([grid.y - shots.outputs[:, 0], grid.u - path[:, -2]])
        H, D = np.zeros((n, 2, s)), np.zeros((n, 2, len(slope)))
        H[:, 0], H[:, 1, -2] = shots.outputs_by[:, 0, q:], 1.0
        D[:, 0] = _columns(shots.outputs_by[:, 0, :q], coordinates.free) * slope
        F = np.ascontiguousarray(shots.by[:, :, q:])
        G = _columns(shots.by[:, :, :q], coordinates.free) * slope
        return cls(E, H, D, F, G, shots.ends - path[1:])

    def without_parameters(self) -> AffineModel:
        """The same with no parameter free, which is filtered in a third of the time."""
        return replace(self, D=np.zeros((len(self.D), 2, 0)), G=np.zeros((*self.G.shape[:2], 0)))


def _columns(values: Array, chosen: NDArray[np.bool_]) -> Array:
    """The chosen last columns, by slices: a mask would take five times as long."""
    if chosen.all() or not chosen.any():
        return values[..., : chosen.sum()]
    places = np.flatnonzero(chosen)
    runs = np.split(places, np.flatnonzero(np.diff(places) > 1) + 1)
    return np.concatenate([values[..., run[0] : run[-1] + 1] for run in runs if len(run)], axis=-1)


def kalman_filter(
    kernel: Kernel, grid: Grid, p: Array, freedom: PathFreedom, model: AffineModel, first: Array
) -> Innovations | None:
    """The innovations of a grid under its affine model, from the variances (s,) of its first state; None where the
    filter has no finite answer.
    """
    n, _, s = model.H.shape
    m = model.D.shape[2]
    noise = np.array([grid.noise_y, freedom.force * grid.force.noise])
    R = np.where(np.isfinite(model.E), noise**2, np.inf)
    A, P, S = np.zeros((n, s)), np.zeros((n, s, s)), np.zeros((n, s, m))
    P[0] = np.diag(first)
    V, J, K = np.empty((n, 3)), np.empty((n, 3, m)), np.empty((n, 3, s))
    E, Q = np.zeros((n, 3)), _noise(kernel, grid, p, freedom, model.jump)
    E[:, :2] = np.nan_to_num(model.E)
    loops().filtered(E, model.H, model.D, model.F, model.G, model.jump, Q, R, A, P, S, V, J, K)
    if not (V > 0).all() or not np.isfinite(E).all() or not np.isfinite(J).all():
        return None
    measured = E[:, :2], V[:, :2]
    return Innovations(*measured, -J[:, :2], measured, (A, P, S, E, V, J, K, model.H, model.F))


def _memory_std(kernel: Kernel, p: Array, share: float) -> Array:
    """Standard deviations of the memory states (n_memory,) as shares of the break-away deflection or of their unit."""
    value = dict(zip(kernel.parameters, p, strict=True))
    deflection = value["lugre.fc"] / value["lugre.sigma0"]
    return np.array([share * (deflection if m.unit == "m" else 1.0) for m in kernel.layout.memory])


def first_variances(kernel: Kernel, grid: Grid, p: Array, freedom: PathFreedom, path: Array) -> Array:
    """Variances (s,) of the first state. Memory that starts at the position or force is as far from it, for all that is
    known, as a part of how far it is along the path: a play may begin anywhere within its gap.
    """
    memory = _memory_std(kernel, p, UNKNOWN) ** 2
    for i, m in enumerate(kernel.layout.memory):
        if m.at_position or m.at_force:
            apart = path[:, 2 + i] - path[:, 0 if m.at_position else -2]
            noise = grid.noise_y if m.at_position else grid.force.noise
            memory[i] = noise**2 + UNKNOWN**2 * float(np.mean(apart**2))
    force = 4 * (freedom.force * grid.force.noise) ** 2
    return np.array([4 * grid.noise_y**2, FIRST_V**2, *memory, force, FIRST_SLOPE**2])


def _noise_of_an_interval(kernel: Kernel, p: Array, freedom: PathFreedom) -> Array:
    """Variances (s - 2,) of what happens to position, velocity and memory in an interval beside the model."""
    return np.array([NOISE_X, NOISE_V, *_memory_std(kernel, p, freedom.bristle)]) ** 2


def _noise(kernel: Kernel, grid: Grid, p: Array, freedom: PathFreedom, jump: Array) -> Array:
    """Covariances (n - 1, s, s) of what happens in the intervals beside the model."""
    s, dt = jump.shape[1], np.diff(grid.t)
    base = _noise_of_an_interval(kernel, p, freedom)
    Q = np.zeros((len(dt), s, s))
    index = np.arange(s - 2)
    Q[:, index, index] = base + freedom.curvature * jump[:, :-2] ** 2
    intensity = freedom.force**2 * grid.force.intensity
    Q[:, -2, -2], Q[:, -1, -1] = intensity * dt**3 / 3, intensity * dt
    Q[:, -2, -1] = Q[:, -1, -2] = intensity * dt**2 / 2
    return Q
