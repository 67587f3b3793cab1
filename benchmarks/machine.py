"""What every benchmark says first: the machine, the versions and the commit."""

from __future__ import annotations

import datetime
import os
import platform
import subprocess
from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path


def machine(*libraries: str) -> str:
    """One line: processor, cores, Python and the versions of the named libraries."""
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
        model = next(line.split(":", 1)[1].strip() for line in lines if line.startswith("model name"))
    except (OSError, StopIteration):
        model = platform.processor() or platform.machine()
    versions = ", ".join(f"{name} {version(name)}" for name in libraries)
    return f"{model}, {os.cpu_count()} cores, Python {platform.python_version()}, {versions}"


def today() -> str:
    """The date of a measurement, UTC."""
    return datetime.datetime.now(datetime.UTC).date().isoformat()


def commit(measured: Sequence[str] = (), left_out: Sequence[str] = ()) -> str:
    """The commit that is measured; a tree with changes is said to be one.

    measured : folders and files that say what comes out, by default all: the last commit that changed any of them;
    left_out : those among them that do not count, as what measuring itself writes.
    """

    def git(*words: str) -> str:
        return subprocess.run(["git", *words], capture_output=True, text=True, check=True).stdout.strip()

    paths = *(f":/{name}" for name in measured or ("",)), *(f":!/{name}" for name in left_out)
    changed = git("status", "--porcelain", "-uno", "--", *paths)
    head = git("log", "-1", "--format=%H", "--", *paths) if measured or left_out else git("rev-parse", "HEAD")
    return head + (" with changes" if changed else "")
