"""What every benchmark says first: the machine, the versions and the commit."""

from __future__ import annotations

import os
import platform
import subprocess
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


def commit(*kept: str) -> str:
    """The commit that is measured; a tree with changes is said to be one. kept : files that measuring itself writes."""

    def git(*words: str) -> str:
        return subprocess.run(["git", *words], capture_output=True, text=True, check=True).stdout.strip()

    return git("rev-parse", "HEAD") + (
        " with changes" if git("status", "--porcelain", "-uno", "--", ":/", *(f":!/{name}" for name in kept)) else ""
    )
