"""The command line: one function per command in `bristle.cli.commands`, heavy imports inside the functions."""

from __future__ import annotations

import os
import sys
from typing import NoReturn


def main() -> NoReturn:
    """Entry point of the console script: sets the process up, then runs the command."""
    # Before numpy is loaded: our matrices are small, and the threads of its BLAS only get in the way of our own.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

    from bristle.cli.clash import clash

    taken = clash()
    if taken:
        print(f"bristle: {taken}", file=sys.stderr)
        sys.exit(2)
    from bristle.cli.app import main as command
    from bristle.cli.memory import one_arena

    one_arena()
    command()
