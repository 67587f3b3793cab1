"""Modbus/TCP Security: TLS 1.2 or newer, and both sides show a certificate that the same authority signed.

Everything about the files is checked before the first connection, so that a wrong certificate is a message and not a
handshake that fails somewhere else.
"""

from __future__ import annotations

import ssl
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from cryptography import x509
from cryptography.hazmat.primitives.serialization import Encoding, PublicFormat, load_pem_private_key

from recordings import BadInput


@dataclass(frozen=True)
class Certificates:
    """PEM files of one side: its own certificate and private key, and the authority that the other side must have."""

    certificate: Path
    key: Path
    authority: Path

    def server_context(self) -> ssl.SSLContext:
        """What a server needs: clients without a certificate of the authority are turned away. Raises BadInput."""
        self._check()
        context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
        context.minimum_version = ssl.TLSVersion.TLSv1_2
        context.verify_mode = ssl.CERT_REQUIRED
        try:
            context.load_cert_chain(self.certificate, self.key, password=_no_password)
            context.load_verify_locations(self.authority)
        except ssl.SSLError as error:
            found = f"not accepted by the TLS library ({error.reason or error})"
            raise BadInput(str(self.certificate), found, "make new certificates") from None
        return context

    def _check(self) -> None:
        own, authority = _certificate(self.certificate), _certificate(self.authority)
        _check_dates(self.certificate, own)
        _check_dates(self.authority, authority)
        if not _is_authority(authority):
            raise BadInput(str(self.authority), "not a certificate authority", "give the CA's certificate here")
        if _public_key(self.key) != own.public_key().public_bytes(Encoding.DER, PublicFormat.SubjectPublicKeyInfo):
            raise BadInput(str(self.key), f"does not belong to {self.certificate}", "give the key of that certificate")


def _no_password() -> str:
    """Never reached: an encrypted key was refused before. Without it the library would ask on the terminal."""
    return ""


def _read(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except OSError as error:
        remedy = "give PEM files with --cert, --key and --ca, or make some for tests: bristle serve --make-test-ca DIR"
        raise BadInput(str(path), f"cannot be read: {error.strerror}", remedy) from None


def _certificate(path: Path) -> x509.Certificate:
    content = _read(path)
    try:
        return x509.load_pem_x509_certificate(content)
    except ValueError:
        raise BadInput(str(path), "not a certificate in PEM form", "give a file with BEGIN CERTIFICATE") from None


def _check_dates(path: Path, certificate: x509.Certificate) -> None:
    now = datetime.now(UTC)
    start, end = certificate.not_valid_before_utc, certificate.not_valid_after_utc
    if now > end:
        raise BadInput(str(path), f"the certificate expired on {end:%Y-%m-%d}", "renew it")
    if now < start:
        raise BadInput(str(path), f"the certificate is valid only from {start:%Y-%m-%d}", "check this machine's clock")


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
