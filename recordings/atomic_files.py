"""Files that appear whole or not at all, and the words for a disk that says no."""

from __future__ import annotations

import errno
import json
import os
import secrets
import stat
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import numpy as np

from recordings.errors import BadInput

try:
    import fcntl
except ModuleNotFoundError:  # Windows: nothing records there, so nobody has to be kept out
    _flock = None
else:
    _flock = fcntl.flock

_REASONS = {
    errno.ENOENT: ("the folder does not exist", "make it first, or choose another path"),
    errno.ENOTDIR: ("its folder is a file", "choose another path"),
    errno.EISDIR: ("it is a directory", "give the name of a file inside it"),
    errno.EACCES: ("there is no permission to write it", "choose another folder, or change its permissions"),
    errno.EPERM: ("there is no permission to write it", "choose another folder, or change its permissions"),
    errno.EROFS: ("the disk is read-only", "choose another folder"),
    errno.ENOSPC: ("the disk is full", "make room, or choose another folder"),
    errno.EDQUOT: ("the disk quota is used up", "make room, or choose another folder"),
    errno.EFBIG: ("the file grew larger than allowed here", "raise the limit, or choose another folder"),
    errno.ENAMETOOLONG: ("the name is too long", "choose a shorter one"),
    errno.EEXIST: ("it exists already", "choose another name, or say that it may be overwritten"),
}

_PASSING = {
    errno.ENOSPC, errno.EDQUOT, errno.EIO, errno.EMFILE, errno.ENFILE, errno.ENOMEM, errno.EINTR, errno.EAGAIN,
    errno.ESTALE, errno.ETIMEDOUT,
}  # fmt: skip


def may_pass(error: OSError) -> bool:
    """Whether the disk or the system is in trouble, which may be over soon, rather than the path a mistake.

    >>> may_pass(OSError(errno.ENOSPC, "no space")), may_pass(OSError(errno.EACCES, "no permission"))
    (True, False)
    """
    return error.errno in _PASSING


def check_regular(path: Path) -> None:
    """Refuse what cannot be read as a file, before a library blocks on a pipe or says less.

    Raises
    ------
    BadInput
        Missing, a directory, a device or pipe, not readable, or empty.
    """
    name = str(path)
    try:
        status = path.stat()
        if stat.S_ISREG(status.st_mode):
            path.open("rb").close()
    except (FileNotFoundError, NotADirectoryError):
        raise BadInput(name, "there is no such file", "check the path") from None
    except PermissionError:
        raise BadInput(name, "there is no permission to read it", "ask its owner for it") from None
    except (OSError, ValueError) as error:
        raise BadInput(name, f"it cannot be opened ({error})", "check the path") from None
    if stat.S_ISDIR(status.st_mode):
        raise BadInput(name, "it is a directory", "name one file inside it")
    if not stat.S_ISREG(status.st_mode):
        raise BadInput(name, "it is not a regular file", "give the path of a file on disk")
    if status.st_size == 0:
        raise BadInput(name, "it is empty (0 bytes)", "copy it again from its origin")


@contextmanager
def writing(path: Path) -> Iterator[None]:
    """Turn an error of the disk, or a lack of memory, while writing `path` into a `BadInput` in words."""
    try:
        yield
    except OSError as error:
        found, remedy = _REASONS.get(
            error.errno or 0, (f"it cannot be written ({error})", "check the path and the disk")
        )
        raise BadInput(str(path), found, remedy) from error
    except MemoryError as error:
        found = "there is not enough memory to write it"
        raise BadInput(str(path), found, "end other programs, then try again") from error


@contextmanager
def appearing(path: Path) -> Iterator[Path]:
    """A temporary file beside `path` that takes its place, on the disk for good, when the block ends well.

    Raises
    ------
    BadInput
        The disk refused; `path` is as it was.
    """
    with writing(path):
        if path.is_dir():
            raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR))
        draft = path.with_name(f".{path.name}.{secrets.token_hex(4)}.tmp")
        try:
            yield draft
            sync(draft)
            draft.replace(path)
            sync(path.parent)
        finally:
            with suppress(FileNotFoundError):
                draft.unlink()


def save_text(path: str | Path, text: str) -> None:
    """Write a text file in UTF-8, whole or not at all; `BadInput` in words when the disk refuses."""
    with appearing(Path(path)) as draft:
        draft.write_text(text, encoding="utf-8")


def save_json(path: str | Path, content: Mapping[str, Any]) -> None:
    """Write a result as JSON, whole or not at all, with null for numbers that are not finite: JSON has no word for
    them. Raises BadInput when the disk refuses.
    """
    save_text(path, json_text(content) + "\n")


def json_text(content: Mapping[str, Any]) -> str:
    """A result as JSON, with null for numbers that are not finite.

    >>> print(json_text({"rmse_m": float("nan"), "file": Path("a.h5")}))
    {
     "rmse_m": null,
     "file": "a.h5"
    }
    """
    return json.dumps(_finite(content), indent=1, allow_nan=False)


def _finite(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {name: _finite(one) for name, one in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(one) for one in value]
    if isinstance(value, float | np.floating):
        return float(value) if np.isfinite(value) else None
    if isinstance(value, np.integer):
        return int(value)
    if isinstance(value, Path):
        return str(value)
    return bool(value) if isinstance(value, np.bool_) else value


def lock(descriptor: int, *, shared: bool = False) -> None:
    """Hold the lock of an open file, alone or with other readers; the system lets it go with the file.

    Where files have no such locks it does nothing. Raises BlockingIOError when another process holds it.
    """
    if _flock is not None:
        _flock(descriptor, (fcntl.LOCK_SH if shared else fcntl.LOCK_EX) | fcntl.LOCK_NB)


def sync(path: Path) -> None:
    """Force a file, or the entries of a folder, onto the disk."""
    if os.name == "nt" and path.is_dir():  # its entries cannot be asked for there
        return
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
