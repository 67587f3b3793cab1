"""Certificates for tests on this machine: an authority that can vouch for loopback addresses and nothing else."""

from __future__ import annotations

import os
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from pathlib import Path

from hil.modbus.tls import Certificates
from recordings import BadInput, not_installed


@dataclass(frozen=True)
class LoopbackAuthority:
    """The files of a test authority: what a server and what a client on this machine need."""

    __test__ = False

    server: Certificates
    client: Certificates


def make_loopback_authority(folder: Path, days: int = 30, start: datetime | None = None) -> LoopbackAuthority:
    """Write an authority, a server and a client certificate with their keys (readable by the user alone) to a folder.

    days : how long they are valid, from `start` (now) on. The authority's own key is not kept: nobody can sign more.
    Raises BadInput when the folder cannot be written or already holds such files, and without the extra ``tls``.
    """
    start = start or datetime.now(UTC) - timedelta(minutes=5)
    try:
        from hil.testing.loopback_certificates import pem_files
    except ImportError:
        raise not_installed(str(folder), "making certificates", "cryptography", "tls") from None
    _write(folder, pem_files((start, start + timedelta(days=days))))
    sides = [Certificates(folder / f"{s}.pem", folder / f"{s}.key", folder / "ca.pem") for s in ("server", "client")]
    return LoopbackAuthority(*sides)


def _write(folder: Path, files: dict[str, bytes]) -> None:
    """All files, none over an existing one; keys are created readable by the user alone, not made so afterwards."""
    try:
        folder.mkdir(parents=True, exist_ok=True, mode=0o700)
        for name, content in files.items():
            mode = 0o600 if name.endswith(".key") else 0o644
            descriptor = os.open(folder / name, os.O_WRONLY | os.O_CREAT | os.O_EXCL, mode)
            with os.fdopen(descriptor, "wb") as file:
                file.write(content)
    except FileExistsError as error:
        raise BadInput(str(error.filename), "is already there", "name a new folder, nothing is overwritten") from None
    except OSError as error:
        where = str(error.filename or folder)
        raise BadInput(where, f"cannot be written: {error.strerror}", "name a folder you can write to") from None
