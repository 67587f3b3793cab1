"""Trying a damaged file on a child process first.

The HDF5 library crashes the interpreter, never returns, or takes gigabytes of memory on some damaged files (one in
six hundred random damages did when this was written, and its issue 1707 is one case). No exception can catch that, so
what a file declares is read in a forked child before it is read here. That costs a few milliseconds. scipy's reader of
MATLAB files crashes as well, and is left to the child alone (`importers/formats/matlab_content.py`).
"""

from __future__ import annotations

import faulthandler
import os
import signal
import warnings
from collections.abc import Callable
from pathlib import Path

from recordings.errors import BadInput

try:
    import resource
except ModuleNotFoundError:  # Windows, which has no fork either
    _CAN_TRY = False
else:
    _CAN_TRY = hasattr(os, "fork")

_PATIENCE_S, _PATIENCE_S_PER_MB = 2, 0.1
_MOST_KILOBYTES, _EXPANSION = 1 << 19, 16
"""Processor time and memory that a reading may take, and so much more for every megabyte, and kilobyte, of the file."""


def probe(path: Path, reading: Callable[[], object], library: str = "the HDF5 library") -> bool:
    """Run a reading of the file in a child process, until it ends in whatever way. Returns whether there was one: some
    systems have no such processes, and a full one has none left.

    library : what reads, for the message.

    Exceptions in the child are ignored: they will come again, and then with words.

    Raises
    ------
    BadInput
        The child crashed, or used more than a few seconds of processor time or half a gigabyte, and what the size of
        the file allows.
    """
    if not _CAN_TRY:
        return False
    try:
        size = path.stat().st_size
    except (OSError, ValueError):  # the reading will say so, with words
        size = 0
    with warnings.catch_warnings():
        # A child of a process with threads may find a lock held; h5py releases its own, and nothing else is used there.
        warnings.simplefilter("ignore", DeprecationWarning)
        try:
            child = os.fork()
        except OSError:  # no memory or no process left for a child: most files are not damaged
            return False
    if child == 0:
        _read_and_exit(reading, size)
    _, status = os.waitpid(child, 0)
    if status:
        found = f"it is damaged so badly that {library} {_end(status)} on it"
        raise BadInput(str(path), found, "copy it again from its origin")
    return True


def _end(status: int) -> str:
    if os.WIFEXITED(status):
        return "asks for gigabytes of memory"
    slow = {signal.SIGXCPU, signal.SIGALRM, signal.SIGKILL}
    return "never comes to an end" if os.WTERMSIG(status) in slow else "crashes"


def _read_and_exit(reading: Callable[[], object], size: int) -> None:
    patience = _PATIENCE_S + int(_PATIENCE_S_PER_MB * size / 1e6)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    try:
        faulthandler.disable()
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        resource.setrlimit(resource.RLIMIT_CPU, (patience, patience + 1))
        signal.signal(signal.SIGALRM, signal.SIG_DFL)
        signal.alarm(10 * patience)
        reading()
    finally:
        grown = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before
        os._exit(int(grown > _MOST_KILOBYTES + _EXPANSION * size // 1024))
