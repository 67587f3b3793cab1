"""Where code built at run time is kept: a private, content-addressed cache of the user.

Code is loaded from here, so nothing may be in it that somebody else wrote or that was damaged: a folder that others
can write to is not used, and every artefact is a folder whose files are checked against their digests before use.
Where nothing can be kept, a folder of this process alone takes its place.
"""

from __future__ import annotations

import contextlib
import functools
import hashlib
import os
import platform
import shutil
import stat
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

try:
    import grp
    import pwd
except ModuleNotFoundError:  # Windows: a profile is private by its access lists, and there are no groups to look at
    _HAS_OWNERS = False
else:
    _HAS_OWNERS = hasattr(os, "getuid")

SEAL = "SHA256"
"""The file with the digests of all the others in an artefact, written last."""

ABANDONED = 86400.0
"""Age [s] at which a folder some process was building in is the leftover of a killed one."""


def artefact(key: str, build: Callable[[Path], None]) -> Path:
    """The folder that `build` has filled for a key: from the cache when it is there and whole, else built now.

    The key names the content: everything `build` depends on. Several processes may ask at once; each gets a whole
    folder. Raises what `build` raises, OSError when there is no room even in the temporary directory.
    """
    name = hashlib.sha256(key.encode()).hexdigest()[:40]
    shared = directory()
    for home in dict.fromkeys((shared, _process_directory())):
        if _whole(home / name):
            return home / name
        with contextlib.suppress(OSError):
            return _built(home, name, build)
    raise OSError(f"no artefact could be written to {shared} or {_process_directory()}")


@functools.cache
def machine() -> tuple[str, ...]:
    """What numba's machine code depends on besides its source: a part of the key of such an artefact."""
    import llvmlite.binding
    import numba

    features = llvmlite.binding.get_host_cpu_features().flatten()
    return numba.__version__, platform.python_version(), llvmlite.binding.get_host_cpu_name(), features


def directory() -> Path:
    """The user's private cache, or the folder of this process where there can be none.

    ``BRISTLE_CACHE`` names another place, for example on a machine whose home is read-only.
    """
    base = os.environ.get("BRISTLE_CACHE") or os.path.join(os.environ.get("XDG_CACHE_HOME") or "~/.cache", "bristle")
    try:
        folder = Path(base).expanduser()
        folder.mkdir(parents=True, exist_ok=True, mode=0o700)
        return folder if _private(folder.resolve()) else _process_directory()
    except (OSError, RuntimeError):  # expanduser raises RuntimeError when there is no home
        return _process_directory()


@functools.cache
def _process_directory() -> Path:
    _sweep_empty(Path(tempfile.gettempdir()))
    holder = tempfile.TemporaryDirectory(prefix="bristle-")
    _HELD.append(holder)
    return Path(holder.name)


_HELD: list[tempfile.TemporaryDirectory[str]] = []
"""Keeps the folder of this process until it ends."""


def _private(folder: Path) -> bool:
    """Whether only we can write to a folder, and nobody can put another in its place."""
    if not _HAS_OWNERS:
        return folder.is_dir()
    facts = folder.stat()
    ours = stat.S_ISDIR(facts.st_mode) and facts.st_uid == os.getuid()
    others = facts.st_mode & (stat.S_IWGRP | stat.S_IWOTH)
    return ours and not others and not any(_replaceable(parent.stat()) for parent in folder.parents)


def _replaceable(parent: os.stat_result) -> bool:
    """Whether somebody else may put another folder in the place of one in `parent`."""
    if parent.st_uid not in (0, os.getuid()):
        return True
    if parent.st_mode & stat.S_ISVTX:  # only the owner of an entry may take it away, or root
        return False
    return bool(parent.st_mode & stat.S_IWOTH) or (bool(parent.st_mode & stat.S_IWGRP) and _shared(parent.st_gid))


def _shared(group: int) -> bool:
    """Whether a group has others in it than us; many systems give each user a group of their own."""
    try:
        user, members = pwd.getpwuid(os.getuid()).pw_name, grp.getgrgid(group).gr_mem
    except KeyError:
        return True
    return group != os.getgid() or bool(set(members) - {user})


def _built(home: Path, name: str, build: Callable[[Path], None]) -> Path:
    """Build beside the target and rename: a reader never sees half an artefact."""
    _sweep(home)
    staging = Path(tempfile.mkdtemp(prefix="build-", dir=home))
    try:
        build(staging)
        (staging / SEAL).write_text(_digests(staging))
        for _ in range(3):
            with contextlib.suppress(OSError):
                return staging.rename(home / name)
            if _whole(home / name):  # another process was faster
                return home / name
            shutil.rmtree(home / name, ignore_errors=True)
        raise OSError(f"{home / name} cannot be replaced")
    finally:
        shutil.rmtree(staging, ignore_errors=True)


def _whole(folder: Path) -> bool:
    """Whether an artefact is ours alone, complete and undamaged."""
    try:
        return _private(folder) and (folder / SEAL).read_text() == _digests(folder)
    except (OSError, UnicodeDecodeError):
        return False


def _digests(folder: Path) -> str:
    files = sorted(path for path in folder.rglob("*") if path.is_file() and path != folder / SEAL)
    return "".join(f"{hashlib.sha256(path.read_bytes()).hexdigest()}  {path.relative_to(folder)}\n" for path in files)


def _sweep_empty(place: Path) -> None:
    """Remove the empty folders of our own that killed processes left behind."""
    for folder in place.glob("bristle-*"):
        with contextlib.suppress(OSError):
            facts = folder.lstat()
            if (not _HAS_OWNERS or facts.st_uid == os.getuid()) and facts.st_mtime < time.time() - ABANDONED:
                folder.rmdir()  # only if it is empty


def _sweep(home: Path) -> None:
    """Remove what killed processes left behind."""
    with contextlib.suppress(OSError):
        for folder in home.glob("build-*"):
            if folder.stat().st_mtime < time.time() - ABANDONED:
                shutil.rmtree(folder, ignore_errors=True)
