"""Machine code of numba that a second process finds ready: compiling the observer takes seconds, loading it does not.

numba's own disk cache keeps its files where others may write and does not notice a change in a function that is
called. So every compiled function becomes an artefact of the private cache of `simulator`, whose key names the text of
all of this room, and numba finds its own files in a folder that is sealed and ours alone.
"""

from __future__ import annotations

import functools
from pathlib import Path
from typing import Any

from numba.core import compiler
from numba.core.caching import IndexDataCacheFile, NullCache

from simulator import artefact, machine

PAYLOAD = "code"


class _Absent(Exception):
    """There is no such artefact."""


class MachineCodeCache(NullCache):  # type: ignore[misc]
    """Where a dispatcher looks for its machine code, and puts it. module, name : of the function."""

    def __init__(self, module: str, name: str) -> None:
        self._name = f"{module}.{name}"

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """The compiled function for a signature, or None."""
        try:
            folder = artefact(self._key(sig), _absent)
        except (_Absent, OSError):
            return None
        target_context.refresh()
        payload = _files(folder).load(PAYLOAD)
        return None if payload is None else compiler.CompileResult._rebuild(target_context, *payload)

    def save_overload(self, sig: Any, cres: Any) -> None:
        """Store a compiled function, where anything can be stored."""

        def write(folder: Path) -> None:
            _files(folder).save(PAYLOAD, cres._reduce())

        try:
            artefact(self._key(sig), write)
        except OSError:
            return  # the next process compiles it again

    def _key(self, sig: Any) -> str:
        return "\0".join(("detector", self._name, str(sig), _sources(), *machine()))


def _files(folder: Path) -> Any:
    """numba's own files of machine code in an artefact; the key of the artefact says all that a stamp would."""
    return IndexDataCacheFile(str(folder), PAYLOAD, PAYLOAD)


def _absent(folder: Path) -> None:
    raise _Absent


@functools.cache
def _sources() -> str:
    """The text of the whole room: a compiled function may call any other of it. Where the room lies does not matter."""
    room = Path(__file__).parents[1]
    return "\0".join(
        f"{path.relative_to(room)}\0{path.read_text(encoding='utf-8')}" for path in sorted(room.rglob("*.py"))
    )
