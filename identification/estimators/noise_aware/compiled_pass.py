"""A pass of the smoother's filter in C: shots, filter and normal equations of a grid in one go (`pass.c`), and the way
back along it.

They answer what `linearise` and `smoothed` of `linearised_model.py` answer without a C compiler.
"""

from __future__ import annotations

import ctypes
import functools
import itertools
import math
from collections.abc import Mapping
from dataclasses import dataclass
from importlib import resources

import numpy as np

from identification.data.grid import Grid
from identification.estimators.coordinates import Coordinates
from identification.estimators.estimate import OUTLIER, TUNING, Innovations, Totals
from identification.estimators.least_squares import Normal
from recordings import Array
from simulator import Kernel


@dataclass(frozen=True)
class PathNoise:
    """What happens beside the model. first (s,) : variances of the first state; base (s - 2,) : of an interval's
    position, velocity and memory; curvature : share of the square of its jump that is added; force : variance of the
    recorded force in units of the grid's; runaway [m/s] : standard deviation of a velocity beyond which it is held.
    """

    first: Array
    base: Array
    curvature: float
    force: float
    runaway: float


def _structure(vectors: str, numbers: str = "", counts: str = "") -> type[ctypes.Structure]:
    """A structure of `pass.c` by the names of its fields."""
    kinds = (vectors, ctypes.c_void_p), (numbers, ctypes.c_double), (counts, ctypes.c_long)
    fields = [(name, kind) for names, kind in kinds for name in names.split()]
    return type("Structure", (ctypes.Structure,), {"_fields_": fields})


GIVEN = _structure(
    "t inputs p slope path y force first base intensity",
    "h_max curvature noise_y noise_force intensity_scale runaway tuning outlier",
    "n honest",
)
SMOOTHER = ("A", "P", "S", "E", "V", "J", "K", "H", "F")
"""What the way back needs of a pass."""
FILLED = _structure(" ".join((*SMOOTHER, "by scored variances gradient matrix totals")))


@functools.cache
def _text() -> str:
    return resources.files("identification.estimators.noise_aware").joinpath("pass.c").read_text("utf-8")


def compiled_pass(kernel: Kernel, coordinates: Coordinates) -> ctypes.CDLL | None:
    """The library of the pass for a kernel and a choice of free parameters, or None without a C compiler."""
    return kernel.scanner.compiled_with(_text(), tuple(np.flatnonzero(coordinates.free).tolist()))


def run(
    library: ctypes.CDLL, kernel: Kernel, coordinates: Coordinates, grid: Grid, p: Array, path: Array, h_max: float,
    noise: PathNoise, honest: bool,
) -> Innovations | None:  # fmt: skip
    """The innovations of a grid along a path (n, s) at parameters p; None where the model or the filter has none.

    honest : they are judged by a filter without `noise.curvature`.
    """
    (n, s), m = path.shape, coordinates.n_free
    given = {
        "t": grid.t, "inputs": kernel.known_inputs(grid.t, grid.force.u, p), "p": p, "slope": coordinates.slope(p),
        "path": path, "y": grid.y, "force": grid.u, "first": noise.first, "base": noise.base,
        "intensity": grid.force.intensity,
    }  # fmt: skip
    given = {name: np.ascontiguousarray(array, float) for name, array in given.items()}
    for_the_way_back = {
        "A": (n, s), "P": (n, s, s), "S": (n, s, m), "J": (n, 3, m), "K": (n, 3, s), "H": (n, 2, s),
        "F": (n - 1, s, s), "by": (n, 2, m),
    }  # fmt: skip
    kept = {
        "E": (n, 3), "V": (n, 3), "scored": (n, 2), "variances": (n, 2), "gradient": (m,), "matrix": (m, m),
        "totals": (5,),
    }  # fmt: skip
    (long, at), (short, and_at) = _together(for_the_way_back), _together(kept)
    out = long | short
    numbers = {
        "h_max": h_max, "curvature": noise.curvature, "noise_y": grid.noise_y, "intensity_scale": noise.force,
        "noise_force": float(np.sqrt(noise.force)) * grid.force.noise, "runaway": noise.runaway, "tuning": TUNING,
        "outlier": OUTLIER, "n": n, "honest": honest and noise.curvature > 0.0,
    }  # fmt: skip
    arguments = GIVEN(**_addresses(given), **numbers), FILLED(**at, **and_at)
    if not library.filter_pass(*(ctypes.byref(argument) for argument in arguments)):
        return None
    loss_y, loss_u, logs, positions, far = out["totals"].tolist()
    totals = Totals(Normal(loss_y + loss_u, out["gradient"], out["matrix"]), logs, loss_y, int(positions), int(far))
    smoother = tuple(out[name] for name in SMOOTHER)
    measured = out["E"][:, :2], out["V"][:, :2]
    return Innovations(*measured, out["by"], (out["scored"], out["variances"]), smoother, totals, library)


def way_back(
    library: ctypes.CDLL, smoother: tuple[Array, ...], move: Array | None, share: float, *, adjoints: bool
) -> tuple[Array, Array]:  # fmt: skip
    """`linearised_model.smoothed`, along what a pass of the same library has kept."""
    mean = smoother[0]
    out, gradient = np.empty_like(mean), np.empty_like(mean if adjoints else mean[:0])
    move = None if move is None else np.ascontiguousarray(move, float)
    kept = FILLED(**_addresses(dict(zip(SMOOTHER, smoother, strict=True))))
    moved, *ends = map(ctypes.c_void_p, _addresses({"move": move, "out": out, "adjoints": gradient}).values())
    library.way_back(ctypes.byref(kept), ctypes.c_long(len(mean)), moved, ctypes.c_double(share), *ends)
    return out, gradient


def _together(shapes: dict[str, tuple[int, ...]]) -> tuple[dict[str, Array], dict[str, int | None]]:
    """Arrays in one piece of memory, which the system hands out in large pages, a quarter of a microsecond a node, and
    their addresses: asked of every array they take as long as the pass of a short grid.
    """
    sizes = [math.prod(shape) for shape in shapes.values()]
    ends = list(itertools.accumulate(sizes))
    whole = np.empty(ends[-1])
    first, arrays, addresses = whole.ctypes.data, dict[str, Array](), dict[str, int | None]()
    for (name, shape), size, end in zip(shapes.items(), sizes, ends, strict=True):
        arrays[name] = whole[end - size : end].reshape(shape)
        addresses[name] = first + whole.itemsize * (end - size) if size else None
    return arrays, addresses


def _addresses(arrays: Mapping[str, Array | None]) -> dict[str, int | None]:
    known = {name: array for name, array in arrays.items() if array is not None and array.size}
    return dict.fromkeys(arrays) | {name: array.__array_interface__["data"][0] for name, array in known.items()}
