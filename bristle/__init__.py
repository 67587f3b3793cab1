"""The command line: one thin function per command in `bristle.commands`, heavy imports inside the functions."""

import os

# Before numpy is loaded: our matrices are small, and the threads of its BLAS only get in the way of our own.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from bristle._app import main
from bristle._memory import one_arena

one_arena()

__all__ = ["main"]
