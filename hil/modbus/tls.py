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
        authorities = self._check()
        if not all(_is_authority(one) for one in authorities):
            raise BadInput(str(self.authority), "not a certificate authority", "give the CA's certificate here")
        context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
        context.verify_mode = ssl.CERT_REQUIRED
        return self._loaded(context)

    def client_context(self) -> ssl.SSLContext:
        """What a client needs: it talks only to the server that the authority vouches for. Raises BadInput."""
        self._check()
        return self._loaded(ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT))

    def _loaded(self, context: ssl.SSLContext) -> ssl.SSLContext:
        _load_own(context, self.certificate, self.key)
        try:
            context.load_verify_locations(self.authority)
        except ssl.SSLError as error:
            raise _not_accepted(self.certificate, error) from None
        return context

    def _check(self) -> list[x509.Certificate]:
        """All that can be wrong with the files by themselves; returns whom the other side must be vouched for by."""
        own, authorities = _certificates(self.certificate), _certificates(self.authority)
        _check_pair(self.certificate, own[0], self.key)
        return authorities


def own_certificate(certificate: Path, key: Path) -> ssl.SSLContext:
    """What a server needs that anybody may connect to over TLS, with no certificate of theirs. Raises BadInput."""
    _check_pair(certificate, _certificates(certificate)[0], key)
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    _load_own(context, certificate, key)
    return context


def _load_own(context: ssl.SSLContext, certificate: Path, key: Path) -> None:
    """Let a context show a certificate, over TLS 1.2 or newer."""
    context.minimum_version = ssl.TLSVersion.TLSv1_2
    try:
        context.load_cert_chain(certificate, key, password=_no_password)
    except ssl.SSLError as error:
        raise _not_accepted(certificate, error) from None


def _not_accepted(certificate: Path, error: ssl.SSLError) -> BadInput:
    found = f"not accepted by the TLS library ({error.reason or error})"
    return BadInput(str(certificate), found, "make new certificates")


def _check_pair(path: Path, certificate: x509.Certificate, key: Path) -> None:
    if _public_key(key) != certificate.public_key().public_bytes(Encoding.DER, PublicFormat.SubjectPublicKeyInfo):
        raise BadInput(str(key), f"does not belong to {path}", "give the key of that certificate")


def is_certificate_trouble(error: BaseException | None) -> bool:
    """Whether the two sides do not accept each other's certificates: time does not heal that, unlike an absent peer."""
    if isinstance(error, ssl.SSLCertVerificationError):
        return True
    reason = str(getattr(error, "reason", "") or "") if isinstance(error, ssl.SSLError) else ""
    return any(word in reason for word in ("CERTIFICATE", "UNKNOWN_CA", "ALERT"))


def _no_password() -> str:
    """Never reached: an encrypted key was refused before. Without it the library would ask on the terminal."""
    return ""


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
