"""Certificates and keys in PEM files: what can be wrong with them by themselves. Needs the extra ``tls``."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path

from cryptography import x509
from cryptography.hazmat.primitives.serialization import Encoding, PublicFormat, load_pem_private_key

from recordings import BadInput


def check_own(certificate: Path, key: Path) -> None:
    """Raises BadInput unless both can be used today and belong together."""
    own = _certificates(certificate)[0]
    if _public_key(key) != own.public_key().public_bytes(Encoding.DER, PublicFormat.SubjectPublicKeyInfo):
        raise BadInput(str(key), f"does not belong to {certificate}", "give the key of that certificate")


def check_authority(path: Path, *, signs: bool) -> None:
    """Raises BadInput unless the other side's authority can be used today. signs : it must be one that signs others."""
    found = _certificates(path)
    if signs and not all(_is_authority(one) for one in found):
        raise BadInput(str(path), "not a certificate authority", "give the CA's certificate here")


def _read(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except OSError as error:
        remedy = "give a PEM file, or have some made for tests on this machine"
        raise BadInput(str(path), f"cannot be read: {error.strerror}", remedy, parameter="certificates") from None


def _certificates(path: Path) -> list[x509.Certificate]:
    """The certificates of a file, at least one, all of them valid today."""
    content = _read(path)
    try:
        found = x509.load_pem_x509_certificates(content)
    except ValueError:
        raise BadInput(str(path), "not a certificate in PEM form", "give a file with BEGIN CERTIFICATE") from None
    now = datetime.now(UTC)
    for one in found:
        if now > one.not_valid_after_utc:
            raise BadInput(str(path), f"the certificate expired on {one.not_valid_after_utc:%Y-%m-%d}", "renew it")
        if now < one.not_valid_before_utc:
            words = f"the certificate is valid only from {one.not_valid_before_utc:%Y-%m-%d}"
            raise BadInput(str(path), words, "check this machine's clock")
    return found


def _is_authority(certificate: x509.Certificate) -> bool:
    try:
        return certificate.extensions.get_extension_for_class(x509.BasicConstraints).value.ca
    except x509.ExtensionNotFound:
        return False


def _public_key(path: Path) -> bytes:
    """The public half of a private key file."""
    content = _read(path)
    try:
        key = load_pem_private_key(content, password=None)
    except TypeError:
        raise BadInput(
            str(path), "the private key has a password", "give a key without one, readable by you alone"
        ) from None
    except ValueError:
        raise BadInput(str(path), "not a private key in PEM form", "give a file with BEGIN PRIVATE KEY") from None
    return key.public_key().public_bytes(Encoding.DER, PublicFormat.SubjectPublicKeyInfo)
