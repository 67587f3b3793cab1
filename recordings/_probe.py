"""Trying a damaged file on a child process first.

The HDF5 library crashes the interpreter, or never returns, on some damaged files (about one in three thousand random
damages did when this was written; its issue 1707 is one case). No exception can catch that, so what a file declares is
looked at in a forked child before it is looked at here. That costs a few milliseconds.
"""

from __future__ import annotations

import faulthandler
import os
import resource
import signal
import warnings
from collections.abc import Callable
from pathlib import Path

from recordings._errors import BadInput

_PATIENCE_S = 2


def probe(path: Path, look: Callable[[], object]) -> None:
    """Run `look` in a child process and come back when it ended, however.

    Exceptions in the child are ignored: they will come again, and then with words.

    Raises
    ------
    BadInput
        The child crashed, or used more than a few seconds of processor time.
    """
    with warnings.catch_warnings():
        # A child of a process with threads may find a lock held; h5py releases its own, and nothing else is used there.
        warnings.simplefilter("ignore", DeprecationWarning)
        try:
            child = os.fork()
        except OSError:  # no memory or no process left for a child: most files are not damaged
            return
    if child == 0:
        _look_and_vanish(look)
    _, status = os.waitpid(child, 0)
    if os.WIFSIGNALED(status):
        number = os.WTERMSIG(status)
        what = "never comes to an end" if number in {signal.SIGXCPU, signal.SIGALRM, signal.SIGKILL} else "crashes"
        found = f"it is damaged so badly that the HDF5 library {what} on it"
        raise BadInput(str(path), found, "copy it again from its origin")


def _look_and_vanish(look: Callable[[], object]) -> None:
    try:
        faulthandler.disable()
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        resource.setrlimit(resource.RLIMIT_CPU, (_PATIENCE_S, _PATIENCE_S + 1))
        signal.signal(signal.SIGALRM, signal.SIG_DFL)
        signal.alarm(10 * _PATIENCE_S)
        look()
    finally:
        os._exit(0)
