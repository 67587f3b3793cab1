"""The loop over a recurrence as Python compiled by numba, for machines without a C compiler.

The translated functions and the text of `loop.py` become one generated module in the private cache. numba keeps its
machine code beside that module, so that a second process starts fast.
"""

from __future__ import annotations

import functools
import hashlib
import sys
import threading
from collections.abc import Callable, Mapping, Sequence
from importlib import resources
from importlib.machinery import SourceFileLoader
from pathlib import Path
from types import ModuleType
from typing import Any

import casadi as ca

from recordings import Array
from simulator.compile.cache import artefact, machine
from simulator.compile.casadi_to_python import python_source
from simulator.compile.recurrence import GAMMA, MOTION, Loop, Loops

PRELUDE = """from __future__ import annotations

import math
from math import *

import numba
import numpy as np

from simulator.compile.arithmetic import *

native = numba.njit(error_model="numpy", nogil=True)
"""

ENTRY = """

def given(dimensions):
    return numba.types.Array(numba.types.float64, dimensions, "C", readonly=True)


def filled(dimensions):
    return numba.types.Array(numba.types.float64, dimensions, "C")


@numba.njit(
    numba.types.int64(
        given(1), given(2), numba.types.boolean, numba.types.float64, given(1), filled(1), filled(2), filled(2),
        filled(3), given(2),
    ),
    error_model="numpy", nogil=True, cache=True,
)
def scan(t, u, hold, h_max, p, s, y, S, Y, resets):
    return loop(t, u, hold, h_max, p, s, y, S, Y, resets, np.empty(EXO))
"""

SHOOT = """

@numba.njit(
    numba.types.int64(
        numba.types.int64, numba.types.int64, given(1), given(2), numba.types.float64, given(1), filled(2), filled(2),
        filled(3), filled(2), filled(3), numba.types.Array(numba.types.uint8, 1, "C", readonly=True),
    ),
    error_model="numpy", nogil=True, cache=True,
)
def shoot(first, last, t, u, h_max, p, z, f, T, y, Y, carried):
    return shot(first, last, t, u, h_max, p, z, f, T, y, Y, carried, np.empty(EXO))
"""
"""The second entry point, in modules of the kernels that are asked for it."""

WITHOUT_DERIVATIVES = {
    "step_jac": "def step_jac(w, s, e, p, new, A, B):\n    pass",
    "output_jac": "def output_jac(s, e, p, y, C, D):\n    pass",
}
"""What stands for the derivatives in runs that do not call them."""

LARGE = 1000
"""Instructions of the derivatives from which on a simulation that never asks for them is not made to wait for them."""

_LOCK = threading.Lock()
"""numba's settings and `sys.modules` are shared by all threads."""


def loops(functions: Mapping[str, ca.Function], exo: int, scale: float, ahead: tuple[float, ...] = ()) -> Loops:
    """The loops compiled by numba; exo: length of that vector. Large derivatives are compiled when first asked for.

    Raises NotImplementedError for an operation that has no translation.
    """
    small = sum(functions[name].n_instructions() for name in WITHOUT_DERIVATIVES) < LARGE
    texts = [source(functions, exo, scale, sensitive or small, ahead) for sensitive in (False, True)]
    entry = functools.cache(lambda text: generated("kernel", text, _arithmetic_text()).scan)
    entry(texts[False])
    whole = functools.cache(lambda: generated("kernel", texts[True] + SHOOT, _arithmetic_text()).shoot)
    return Loops(functools.partial(_call, entry, texts), lambda *arguments: int(whole()(*arguments)))


def _call(
    entry: Callable[[str], Loop], texts: Sequence[str], t: Array, u: Array, hold: bool, h_max: float, p: Array,
    s: Array, y: Array, S: Array, Y: Array, resets: Array,
) -> int:  # fmt: skip
    return int(entry(texts[len(Y) > 0])(t, u, hold, h_max, p, s, y, S, Y, resets))


def source(
    functions: Mapping[str, ca.Function], exo: int, scale: float, sensitive: bool, ahead: tuple[float, ...] = ()
) -> str:
    """The text of the generated module; where it need not be `sensitive`, without derivatives."""
    translated = [
        python_source(function, scalars=("w",), returned=name in ("residual", "guess"))
        if sensitive or name not in WITHOUT_DERIVATIVES
        else WITHOUT_DERIVATIVES[name]
        for name, function in functions.items()
    ]
    constants = (
        f"SCALE = {float(scale)!r}\nEXO = {exo}\nMOTION = {MOTION}\nGAMMA = {GAMMA!r}\n"
        f"AHEAD = np.array({list(ahead)}, dtype=np.float64)\n"
    )
    return "\n\n@native\n".join((PRELUDE + constants, *translated)) + "\n\n\n" + _loop_text() + ENTRY


def native_module(name: str, text: str) -> ModuleType:
    """A module of numba functions from its text, compiled once per machine and kept in the private cache.

    name : a word for it. The functions that are called from outside need signatures and ``cache=True``; the text may
    import libraries, and nothing of ours.
    """
    return generated(name, text, "")


def generated(name: str, text: str, imported: str) -> ModuleType:
    """The module of a generated text, from the cache or compiled now; imported : text of what of ours it imports."""
    key = "\0".join((text, imported, *machine()))
    name = f"bristle_{name}_{hashlib.sha256(key.encode()).hexdigest()[:16]}"
    with _LOCK:
        folder = artefact(key, functools.partial(_write, name, text))
        return _module(name, folder)


def _write(name: str, text: str, folder: Path) -> None:
    (folder / "kernel.py").write_text(text, encoding="utf-8")
    _module(name, folder)


def _module(name: str, folder: Path) -> ModuleType:
    """Import the generated module, which makes numba compile it or load what it compiled before."""
    import numba

    module = ModuleType(name)
    sys.modules[name] = module  # numba looks the module up by name when it loads machine code
    elsewhere, numba.config.CACHE_DIR = numba.config.CACHE_DIR, ""  # machine code stays beside the module
    try:
        _Loader(name, str(folder / "kernel.py")).exec_module(module)
    finally:
        numba.config.CACHE_DIR = elsewhere
    return module


class _Loader(SourceFileLoader):
    """Imports a source file and writes no bytecode: the folder it lies in is sealed."""

    def set_data(self, path: str, data: Any, *, _mode: int = 0o666) -> None:
        """Keep nothing."""


@functools.cache
def _loop_text() -> str:
    text = resources.files("simulator.compile").joinpath("loop.py").read_text(encoding="utf-8")
    return text.partition("# The loop\n")[2].strip("\n")


@functools.cache
def _arithmetic_text() -> str:
    return resources.files("simulator.compile").joinpath("arithmetic.py").read_text(encoding="utf-8")
