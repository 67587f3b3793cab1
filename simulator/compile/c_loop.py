"""The loop over a recurrence as C, for machines with a C compiler."""

from __future__ import annotations

import ctypes
import functools
import logging
from collections.abc import Mapping
from importlib import resources
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from recordings import Array
from simulator.compile.c_compiler import BuildFailed, compiler, shared_library
from simulator.compile.casadi_to_lanes import lanes_source
from simulator.compile.recurrence import GAMMA, Loops, Recurrence, Sizes


def loops(
    functions: Mapping[str, ca.Function], sizes: Sizes, scale: float, ahead: tuple[float, ...] = ()
) -> Loops | None:
    """The compiled loops, or None when no compiler works here."""
    library = with_sub_steps(functions, sizes, scale, ahead, _text("loop.c"))
    if library is None:
        return None
    library.scan.restype = ctypes.c_long
    library.shoot.restype = ctypes.c_long
    return Loops(functools.partial(_call, library), functools.partial(_call_shoot, library))


def with_sub_steps(
    functions: Mapping[str, ca.Function], sizes: Sizes, scale: float, ahead: tuple[float, ...], text: str,
    native: bool = False,
) -> ctypes.CDLL | None:  # fmt: skip
    """C text compiled behind the sub-steps of a recurrence (`sub_step.c`), or None when no compiler works here."""
    command = compiler()
    if command is None:
        return None
    try:
        return shared_library(command, _source(functions, sizes, scale, ahead) + text, native)
    except BuildFailed as failure:
        logging.getLogger(__name__).warning("%s; going on without a C compiler", failure)
        return None


def with_shots(recurrence: Recurrence, columns: tuple[int, ...], text: str) -> ctypes.CDLL | None:
    """C text compiled behind `sub_step.c` and `shoot_lanes.c`, which take derivatives by these of the parameters, for
    the vectors of this processor. None when no compiler works here, or an operation has no translation.
    """
    functions, carry = recurrence.functions(columns), recurrence.carried(columns)
    lanes = [lanes_source(f, ("p",)) for f in (functions["guess"], functions["residual"], functions["step"], carry)]
    rows, places = carry.sparsity_out(1).row(), carry.sparsity_out(1).get_col()
    tables = "".join(
        f"static const int {name}[] = {{{', '.join(map(str, values))}}};\n"
        for name, values in (("ROW", rows), ("COLUMN", places))
    )
    if None in lanes:
        return None
    parts = (_text("lanes.c"), *map(str, lanes), f"#define NZ {len(rows)}", tables, _text("shoot_lanes.c"), text)
    sizes = recurrence.sizes._replace(parameters=len(columns))
    return with_sub_steps(functions, sizes, recurrence.scale, recurrence.ahead, "\n".join(parts), native=True)


def _call(
    library: Any, t: Array, u: Array, hold: bool, h_max: float, p: Array, s: Array, y: Array, S: Array, Y: Array,
    resets: Array,
) -> int:  # fmt: skip
    return int(
        library.scan(
            ctypes.c_long(len(t)), _pointer(t), _pointer(u), ctypes.c_int(hold), ctypes.c_double(h_max), _pointer(p),
            _pointer(s), _pointer(y), _pointer(S), _pointer(Y), _pointer(resets),
        )
    )  # fmt: skip


def _call_shoot(
    library: Any, first: int, last: int, t: Array, u: Array, h_max: float, p: Array, z: Array, f: Array, T: Array,
    y: Array, Y: Array, carried: NDArray[np.uint8],
) -> int:  # fmt: skip
    return int(
        library.shoot(
            ctypes.c_long(first), ctypes.c_long(last), ctypes.c_long(len(t)), _pointer(t), _pointer(u),
            ctypes.c_double(h_max), _pointer(p), _pointer(z), _pointer(f), _pointer(T), _pointer(y), _pointer(Y),
            ctypes.c_void_p(carried.ctypes.data),
        )
    )  # fmt: skip


def _pointer(array: Array) -> ctypes.c_void_p:
    return ctypes.c_void_p(array.ctypes.data if len(array) else None)


def _source(functions: Mapping[str, ca.Function], sizes: Sizes, scale: float, ahead: tuple[float, ...]) -> str:
    generator = ca.CodeGenerator("kernel", {"with_header": False, "cpp": False})
    for function in functions.values():
        generator.add(function)
    numbers = {
        "NS": sizes.states, "NE": sizes.exo, "NU": sizes.inputs, "NP": sizes.parameters, "NY": sizes.outputs,
        "NC": sizes.parameters + sizes.states, "SCALE": repr(float(scale)), "STAGES": 2 if ahead else 1,
        "GAMMA": repr(GAMMA),
    }  # fmt: skip
    definitions = "".join(f"#define {name} {value}\n" for name, value in numbers.items())
    definitions += f"static const double AHEAD[] = {{{', '.join(map(repr, ahead or (0.0,)))}}};\n"
    # Static functions can be inlined, and never meet a symbol of the C library that has the same name.
    return "#define CASADI_SYMBOL_EXPORT static\n" + generator.dump() + definitions + _text("sub_step.c")


@functools.cache
def _text(name: str) -> str:
    return resources.files("simulator.compile").joinpath(name).read_text(encoding="utf-8")
