"""Modbus/TCP Security: TLS 1.2 or newer, and both sides show a certificate that the same authority signed.

Everything about the files is checked before the first connection, so that a wrong certificate is a message and not a
handshake that fails somewhere else.
"""

from __future__ import annotations

import ssl
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType

from recordings import BadInput, not_installed


@dataclass(frozen=True)
class Certificates:
    """PEM files of one side: its own certificate and private key, and the authority that the other side must have."""

    certificate: Path
    key: Path
    authority: Path

    def server_context(self) -> ssl.SSLContext:
        """What a server needs: clients without a certificate of the authority are turned away. Raises BadInput."""
        self._check(signs=True)
        context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
        context.verify_mode = ssl.CERT_REQUIRED
        return self._loaded(context)

    def client_context(self) -> ssl.SSLContext:
        """What a client needs: it talks only to the server that the authority vouches for. Raises BadInput."""
        self._check(signs=False)
        return self._loaded(ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT))

    def _loaded(self, context: ssl.SSLContext) -> ssl.SSLContext:
        _load_own(context, self.certificate, self.key)
        try:
            context.load_verify_locations(self.authority)
        except ssl.SSLError as error:
            raise _not_accepted(self.certificate, error) from None
        return context

    def _check(self, *, signs: bool) -> None:
        """All that can be wrong with the files by themselves. signs : the authority is one of other certificates."""
        files = _certificate_files(self.certificate)
        files.check_own(self.certificate, self.key)
        files.check_authority(self.authority, signs=signs)


def own_certificate(certificate: Path, key: Path) -> ssl.SSLContext:
    """What a server needs that anybody may connect to over TLS, with no certificate of theirs. Raises BadInput."""
    _certificate_files(certificate).check_own(certificate, key)
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    _load_own(context, certificate, key)
    return context


def _certificate_files(path: Path) -> ModuleType:
    """What reads certificates, with a library that only users of TLS need. Raises BadInput when that is missing."""
    try:
        from hil.modbus import certificate_files
    except ImportError:
        raise not_installed(str(path), "TLS", "cryptography", "tls") from None
    return certificate_files


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


def is_certificate_trouble(error: BaseException | None) -> bool:
    """Whether the two sides do not accept each other's certificates: time does not heal that, unlike an absent peer."""
    if isinstance(error, ssl.SSLCertVerificationError):
        return True
    reason = str(getattr(error, "reason", "") or "") if isinstance(error, ssl.SSLError) else ""
    return any(word in reason for word in ("CERTIFICATE", "UNKNOWN_CA", "ALERT"))


def _no_password() -> str:
    """Never reached: an encrypted key was refused before. Without it the library would ask on the terminal."""
    return ""
