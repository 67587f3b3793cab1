"""What is wrong with a file: raised at once when reading, collected when validating.

Here, and nowhere else, what h5py raises becomes a `BadInput`. On a damaged file it raises almost anything,
depending on which byte is wrong.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from recordings.errors import BadInput

_H5PY_RAISES = (
    ArithmeticError,
    AttributeError,
    LookupError,
    MemoryError,
    OSError,
    RuntimeError,
    SystemError,
    TypeError,
    ValueError,
)


@contextmanager
def h5py_errors(where: str) -> Iterator[None]:
    """Turn whatever h5py raises inside into a `BadInput` about `where`."""
    try:
        yield
    except BadInput:
        raise
    except _H5PY_RAISES as error:
        raise unreadable(where, error) from error


@contextmanager
def hdf5_refusals(path: Path) -> Iterator[None]:
    """Turn what h5py raises while it writes into a `BadInput`, where it has no words of its own: without memory it
    raises almost anything.
    """
    try:
        yield
    except (BadInput, OSError, MemoryError):
        raise
    except _H5PY_RAISES as error:
        words = " ".join(str(error).split())[:150]
        raise BadInput(str(path), f"it cannot be written (HDF5: {words})", "record into a new file") from error


def unreadable(where: str, error: Exception) -> BadInput:
    """What h5py raised about `where`, in words."""
    if isinstance(error, MemoryError):
        return BadInput(where, "there is not enough memory to read it", "ask for fewer signals")
    words = " ".join(str(error).split())[:150]
    found = f"it cannot be read (HDF5: {words})" if words else f"it cannot be read ({type(error).__name__})"
    return BadInput(where, found, "the file is damaged here; copy it again from its origin")


class Problems:
    """The list of what is wrong with one file.

    keep_going : collect every problem in `found`; without it the first one is raised.
    """

    def __init__(self, *, keep_going: bool) -> None:
        self.found: list[BadInput] = []
        self._keep_going = keep_going

    def add(self, where: str, found: str, remedy: str) -> None:
        """Note one problem; raises it when the first is enough."""
        self._note(BadInput(where, found, remedy))

    @contextmanager
    def within(self, where: str) -> Iterator[None]:
        """Note what goes wrong inside, which is left at that point."""
        try:
            with h5py_errors(where):
                yield
        except BadInput as problem:
            self._note(problem)

    def _note(self, problem: BadInput) -> None:
        if not self._keep_going:
            raise problem
        self.found.append(problem)
