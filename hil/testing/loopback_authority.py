"""Certificates for tests on this machine: an authority that can vouch for loopback addresses and nothing else."""

from __future__ import annotations

import ipaddress
import os
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from pathlib import Path

from cryptography import x509
from cryptography.hazmat.primitives import hashes
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.hazmat.primitives.serialization import Encoding, NoEncryption, PrivateFormat
from cryptography.x509.oid import ExtendedKeyUsageOID, NameOID

from hil.modbus.tls import Certificates
from recordings import BadInput

_NAMES = [
    x509.DNSName("localhost"),
    x509.IPAddress(ipaddress.ip_address("127.0.0.1")),
    x509.IPAddress(ipaddress.ip_address("::1")),
]
_PERMITTED = [
    x509.DNSName("localhost"),
    x509.IPAddress(ipaddress.ip_network("127.0.0.0/8")),
    x509.IPAddress(ipaddress.ip_network("::1/128")),
]


@dataclass(frozen=True)
class LoopbackAuthority:
    """The files of a test authority: what a server and what a client on this machine need."""

    __test__ = False

    server: Certificates
    client: Certificates


def make_loopback_authority(folder: Path, days: int = 30, start: datetime | None = None) -> LoopbackAuthority:
    """Write an authority, a server and a client certificate with their keys (readable by the user alone) to a folder.

    days : how long they are valid, from `start` (now) on. The authority's own key is not kept: nobody can sign more.
    Raises BadInput when the folder cannot be written or already holds such files.
    """
    start = start or datetime.now(UTC) - timedelta(minutes=5)
    span = (start, start + timedelta(days=days))
    authority_key = ec.generate_private_key(ec.SECP256R1())
    authority = _authority(authority_key, span)
    files = {"ca.pem": authority.public_bytes(Encoding.PEM)}
    for side, usage in (("server", ExtendedKeyUsageOID.SERVER_AUTH), ("client", ExtendedKeyUsageOID.CLIENT_AUTH)):
        key = ec.generate_private_key(ec.SECP256R1())
        files[f"{side}.pem"] = _signed(side, key, usage, authority, authority_key, span).public_bytes(Encoding.PEM)
        files[f"{side}.key"] = key.private_bytes(Encoding.PEM, PrivateFormat.PKCS8, NoEncryption())
    _write(folder, files)
    sides = [Certificates(folder / f"{s}.pem", folder / f"{s}.key", folder / "ca.pem") for s in ("server", "client")]
    return LoopbackAuthority(*sides)


def _subject(what: str) -> x509.Name:
    return x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, f"bristle test {what} (loopback only)")])


def _authority(key: ec.EllipticCurvePrivateKey, span: tuple[datetime, datetime]) -> x509.Certificate:
    name, public = _subject("authority"), key.public_key()
    usage = x509.KeyUsage(False, False, False, False, False, True, True, False, False)
    return (
        _builder(name, name, public, span)
        .add_extension(x509.BasicConstraints(ca=True, path_length=0), critical=True)
        .add_extension(usage, critical=True)
        .add_extension(x509.NameConstraints(permitted_subtrees=_PERMITTED, excluded_subtrees=None), critical=True)
        .add_extension(x509.SubjectKeyIdentifier.from_public_key(public), critical=False)
        .sign(key, hashes.SHA256())
    )


def _signed(
    side: str,
    key: ec.EllipticCurvePrivateKey,
    purpose: x509.ObjectIdentifier,
    authority: x509.Certificate,
    authority_key: ec.EllipticCurvePrivateKey,
    span: tuple[datetime, datetime],
) -> x509.Certificate:
    issuer = x509.AuthorityKeyIdentifier.from_issuer_public_key(authority_key.public_key())
    usage = x509.KeyUsage(True, False, False, False, True, False, False, False, False)
    return (
        _builder(_subject(side), authority.subject, key.public_key(), span)
        .add_extension(x509.BasicConstraints(ca=False, path_length=None), critical=True)
        .add_extension(usage, critical=True)
        .add_extension(x509.ExtendedKeyUsage([purpose]), critical=False)
        .add_extension(x509.SubjectAlternativeName(_NAMES), critical=False)
        .add_extension(issuer, critical=False)
        .sign(authority_key, hashes.SHA256())
    )


def _builder(
    subject: x509.Name, issuer: x509.Name, public: ec.EllipticCurvePublicKey, span: tuple[datetime, datetime]
) -> x509.CertificateBuilder:
    return (
        x509.CertificateBuilder()
        .subject_name(subject)
        .issuer_name(issuer)
        .public_key(public)
        .serial_number(x509.random_serial_number())
        .not_valid_before(span[0])
        .not_valid_after(span[1])
    )


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
