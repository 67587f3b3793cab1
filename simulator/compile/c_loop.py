"""The loop over a recurrence as C, for machines with a C compiler."""

from __future__ import annotations

import ctypes
import functools
import logging
from collections.abc import Iterable
from importlib import resources
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from recordings import Array
from simulator.compile.c_compiler import BuildFailed, compiler, shared_library
from simulator.compile.casadi_to_lanes import lanes_source
from simulator.compile.recurrence import GAMMA, MOTION, Loops, Recurrence, Sizes

CALLED = {
    False: ("guess", "residual", "step", "output"),
    True: ("guess", "residual", "step_jac", "output_jac"),
}
"""The functions that the loops call without derivatives and with them."""


def loops(recurrence: Recurrence, sensitive: bool) -> Loops | None:
    """The compiled loops with derivatives or without, or None when no compiler works here."""
    numbers = _about(recurrence) + f"#define DERIVATIVES {int(sensitive)}\n"
    functions = recurrence.functions(names=CALLED[sensitive]).values()
    texts = _sizes(recurrence.sizes), _text("parts.h"), _generated(functions), numbers, _text("sub_step.c")
    library = _library("\n".join((*texts, _text("loop.c"))))
    if library is None:
        return None
    vector, number, whole = ctypes.c_void_p, ctypes.c_double, ctypes.c_long
    library.scan.argtypes = (whole, vector, vector, ctypes.c_int, number, *(vector,) * 6)
    library.shoot.argtypes = (whole, whole, whole, vector, vector, number, *(vector,) * 7)
    library.scan.restype = library.shoot.restype = whole
    return Loops(functools.partial(_call, library), functools.partial(_call_shoot, library))


def with_shots(recurrence: Recurrence, columns: tuple[int, ...], text: str) -> ctypes.CDLL | None:
    """C text linked to `shoot_lanes.c`, which takes derivatives by these of the parameters, for the vectors of this
    processor. None when no compiler works here, or an operation has no translation.

    The text is compiled apart, behind `shots.h`: it is often the larger part, and depends on the sizes alone.
    """
    sizes = _sizes(recurrence.sizes._replace(parameters=len(columns)))
    sub_steps = _sub_steps_on_lanes(recurrence, columns)
    if sub_steps is None:
        return None
    shots = "\n".join((sub_steps, _text("shoot_lanes.c")))
    return _library(shots, "\n".join((sizes, _text("parts.h"), _text("shots.h"), text)), native=True)


SEGMENT: Any = type(
    "Segment", (ctypes.Structure,),
    {"_fields_": [(name, ctypes.c_void_p) for name in ("t", "u", "resets", "s", "y", "Y")]
     + [(name, ctypes.c_long) for name in ("n", "hold")]},
)  # fmt: skip
"""`Segment` of `scan_lanes.c`."""


def scan_on_lanes(recurrence: Recurrence, columns: tuple[int, ...]) -> ctypes.CDLL | None:
    """`scan_lanes.c`, which takes derivatives by these of the parameters. None as for `with_shots`."""
    sub_steps = _sub_steps_on_lanes(recurrence, columns)
    library = None if sub_steps is None else _library("\n".join((sub_steps, _text("scan_lanes.c"))), native=True)
    if library is not None:
        library.scan_lanes.argtypes = (ctypes.c_long, ctypes.c_void_p, ctypes.c_double, ctypes.c_void_p)
    return library


def _sub_steps_on_lanes(recurrence: Recurrence, columns: tuple[int, ...]) -> str | None:
    """`sub_step_lanes.c` behind the functions of a recurrence, or None when an operation has no translation."""
    functions, carry = (
        recurrence.functions(columns, ("guess", "residual", "step", "output_jac")),
        recurrence.carried(columns),
    )
    lanes = [lanes_source(f, ("p",)) for f in (functions["guess"], functions["residual"], functions["step"], carry)]
    rows, places = carry.sparsity_out(1).row(), carry.sparsity_out(1).get_col()
    tables = "".join(
        f"static const int {name}[] = {{{', '.join(map(str, values))}}};\n"
        for name, values in (("ROW", rows), ("COLUMN", places))
    )
    if None in lanes:
        return None
    output = _generated([functions["output_jac"]])
    shared = _sizes(recurrence.sizes._replace(parameters=len(columns))), _text("lanes.c"), _text("parts.h")
    numbers = output, *map(str, lanes), _about(recurrence), f"#define NZ {len(rows)}", tables
    return "\n".join((*shared, *numbers, _text("sub_step_lanes.c")))


def _library(*sources: str, native: bool = False) -> ctypes.CDLL | None:
    """The library of some C sources, or None when no compiler works here."""
    command = compiler()
    if command is None:
        return None
    try:
        return shared_library(command, *sources, native=native)
    except BuildFailed as failure:
        logging.getLogger(__name__).warning("%s; going on without a C compiler", failure)
        return None


def _call(
    library: Any, t: Array, u: Array, hold: bool, h_max: float, p: Array, s: Array, y: Array, S: Array, Y: Array,
    resets: Array,
) -> int:  # fmt: skip
    vectors = map(_pointer, (p, s, y, S, Y, resets))
    return library.scan(len(t), _pointer(t), _pointer(u), hold, h_max, *vectors)


def _call_shoot(
    library: Any, first: int, last: int, t: Array, u: Array, h_max: float, p: Array, z: Array, f: Array, T: Array,
    y: Array, Y: Array, carried: NDArray[np.uint8],
) -> int:  # fmt: skip
    vectors = map(_pointer, (p, z, f, T, y, Y))
    return library.shoot(first, last, len(t), _pointer(t), _pointer(u), h_max, *vectors, carried.ctypes.data)


def _pointer(array: Array) -> int | None:
    address: int = array.__array_interface__["data"][0]  # twice as fast as by way of its `ctypes`
    return address if len(array) else None


def _generated(functions: Iterable[ca.Function]) -> str:
    """The C code of functions, static: so they can be inlined, and never meet a symbol of the C library."""
    generator = ca.CodeGenerator("kernel", {"with_header": False, "cpp": False})
    for function in functions:
        generator.add(function)
    return "#define CASADI_SYMBOL_EXPORT static\n" + str(generator.dump())


def _sizes(sizes: Sizes) -> str:
    """The sizes as `parts.h` needs them."""
    numbers = {
        "NS": sizes.states, "NE": sizes.exo, "NU": sizes.inputs, "NP": sizes.parameters, "NY": sizes.outputs,
        "NC": sizes.parameters + sizes.states,
    }  # fmt: skip
    return "".join(f"#define {name} {value}\n" for name, value in numbers.items())


def _about(recurrence: Recurrence) -> str:
    """What a sub-step needs to know of a recurrence besides its functions."""
    ahead = recurrence.ahead
    numbers = {"SCALE": float(recurrence.scale), "STAGES": 2 if ahead else 1, "GAMMA": GAMMA, "MOTION": MOTION}
    definitions = "".join(f"#define {name} {value!r}\n" for name, value in numbers.items())
    return definitions + f"static const double AHEAD[] = {{{', '.join(map(repr, ahead or (0.0,)))}}};\n"


@functools.cache
def _text(name: str) -> str:
    return resources.files("simulator.compile").joinpath("c", name).read_text(encoding="utf-8")
