"""The client's side of Modbus/TCP Security: TLS 1.2 or newer, both sides show certificates."""

from __future__ import annotations

import ssl
from datetime import UTC, datetime
from pathlib import Path

from cryptography import x509

from hil._source_address import TlsAddress
from recordings import BadInput

_PEM = "give a PEM file"


def client_context(address: TlsAddress) -> ssl.SSLContext:
    """The TLS settings of an address.

    Raises BadInput when a certificate or key is missing, is not one, does not fit the other, or is not valid today.
    """
    for path in (address.ca, address.cert):
        _check_dates(path)
    _read(address.key)
    context = ssl.create_default_context(ssl.Purpose.SERVER_AUTH)
    context.minimum_version = ssl.TLSVersion.TLSv1_2
    try:
        context.load_verify_locations(address.ca)
    except (ssl.SSLError, OSError) as error:
        raise BadInput(str(address.ca), f"no certificate to trust ({error})", _PEM) from None
    try:
        context.load_cert_chain(address.cert, address.key, password=lambda: "")
    except (ssl.SSLError, OSError) as error:
        found = f"it is not the key of {address.cert}, or protected by a password ({error})"
        raise BadInput(str(address.key), found, "give the private key of that certificate, without password") from None
    return context


def is_certificate_trouble(error: BaseException | None) -> bool:
    """Whether the two sides do not accept each other's certificates: time does not heal that, unlike an absent peer."""
    if isinstance(error, ssl.SSLCertVerificationError):
        return True
    reason = str(getattr(error, "reason", "") or "") if isinstance(error, ssl.SSLError) else ""
    return "CERTIFICATE" in reason or "UNKNOWN_CA" in reason or "ALERT" in reason


def _check_dates(path: Path) -> None:
    try:
        certificates = x509.load_pem_x509_certificates(_read(path))
    except ValueError as error:
        raise BadInput(str(path), f"it is not a certificate ({error})", _PEM) from None
    now = datetime.now(UTC)
    for certificate in certificates:
        if certificate.not_valid_after_utc < now:
            found = f"the certificate expired on {certificate.not_valid_after_utc:%Y-%m-%d}"
            raise BadInput(str(path), found, "get a new one from whoever issued it")
        if certificate.not_valid_before_utc > now:
            found = f"the certificate is valid only from {certificate.not_valid_before_utc:%Y-%m-%d}"
            raise BadInput(str(path), found, "check the clock of this machine")


def _read(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except OSError as error:
        raise BadInput(
            str(path), f"it cannot be read ({error.strerror})", "check the path and its permissions"
        ) from None
