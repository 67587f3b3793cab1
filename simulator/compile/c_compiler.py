"""Shared libraries from C source: compiled once per user and machine."""

from __future__ import annotations

import ctypes
import functools
import os
import platform
import shlex
import shutil
import subprocess
from pathlib import Path

from simulator.compile.cache import artefact, machine

FLAGS = (
    *("-O3", "-fPIC", "-shared", "-std=c99", "-ffp-contract=off", "-fno-math-errno"),
    *("-fno-trapping-math", "-fno-signed-zeros", "-fno-gcse", "-fno-gcse-after-reload"),
)
"""No contraction and no reordering: every way of running a kernel gives the same numbers. Nothing looks at floating
point flags or at the sign of a zero, and knowing that makes the loops an eighth faster. Without a global search for
common subexpressions, which casadi has removed, they are as fast and compiled in three quarters of the time."""

NATIVE = ("-march=native", "-O2", "-ftree-vectorize", "-funroll-loops")
"""For all that this processor can do. Code in vectors is as fast as with -O3, which takes over twice the time for the
filter of a pass."""

PATIENCE = 300.0
"""Longest time [s] a compiler may take."""


class BuildFailed(Exception):
    """There is a C compiler, but what it makes of our source cannot be used; the text says why."""


def compiler() -> tuple[str, ...] | None:
    """The command of the C compiler: ``CC`` (a path, or a command with options), else cc, gcc or clang.

    None when there is none or ``BRISTLE_NO_COMPILER`` is set.
    """
    if os.environ.get("BRISTLE_NO_COMPILER"):
        return None
    wish = os.environ.get("CC", "")
    for command in ((wish,), tuple(_words(wish)), ("cc",), ("gcc",), ("clang",)):
        if command and command[0] and (path := shutil.which(command[0])):
            return (os.path.abspath(path), *command[1:])
    return None


def _words(text: str) -> list[str]:
    try:
        return shlex.split(text)
    except ValueError:  # a quotation without an end
        return []


def shared_library(command: tuple[str, ...], *sources: str, native: bool = False) -> ctypes.CDLL:
    """Compile C sources with a command as `compiler` gives it, or find them compiled in the cache, and load them.

    Of several sources each is compiled apart and kept, for libraries that share one. native : for all that this
    processor can do, which another one may not. Raises BuildFailed when they cannot be compiled, kept or loaded.
    """
    flags = (*FLAGS, *NATIVE) if native else FLAGS
    here = (*command, _version(command), *(machine() if native else (platform.machine(),)))
    try:
        if len(sources) == 1:
            folder = _kept("kernel.so", (*command, *flags), here, sources[0])
        else:
            objects = [_kept("part.o", (*command, *flags, "-c"), here, source) for source in sources]
            key = "\0".join((*(folder.name for folder in objects), *flags, *here))
            parts = [str(folder / "part.o") for folder in objects]
            folder = artefact(key, lambda folder: build((*command, *flags), folder / "kernel.so", parts))
        return ctypes.CDLL(str(folder / "kernel.so"))
    except OSError as error:
        raise BuildFailed(f"the compiled physics cannot be loaded ({error})") from error


@functools.cache
def _version(command: tuple[str, ...]) -> str:
    return _run((*command, "--version")).stdout


def _kept(name: str, command: tuple[str, ...], here: tuple[str, ...], source: str) -> Path:
    """The folder with a file that the compiler makes of a source."""
    return artefact("\0".join((source, *command, *here)), functools.partial(_compile, command, source, name))


def _compile(command: tuple[str, ...], source: str, name: str, folder: Path) -> None:
    unit = folder / "kernel.c"
    unit.write_text(source, encoding="utf-8")
    build(command, folder / name, [str(unit)])
    unit.unlink()


def build(command: tuple[str, ...], target: Path, inputs: list[str]) -> None:
    """Make a target of C sources or objects. command : compiler and flags. Raises BuildFailed, which says why."""
    done = _run((*command, "-o", str(target), *inputs, "-lm"))
    if done.returncode != 0 or not target.is_file():
        said = (done.stderr.strip() or f"exit code {done.returncode}, no message").splitlines()[0]
        raise BuildFailed(f"the C compiler {command[0]} failed ({said})")


def _run(command: tuple[str, ...]) -> subprocess.CompletedProcess[str]:
    try:
        return subprocess.run(
            command, capture_output=True, text=True, errors="replace", check=False, timeout=PATIENCE,
            stdin=subprocess.DEVNULL,
        )  # fmt: skip
    except (OSError, subprocess.TimeoutExpired) as error:
        raise BuildFailed(f"the C compiler {command[0]} cannot be run ({error})") from error
