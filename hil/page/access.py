"""Who may look at the page: this machine alone, or with a token over TLS whoever the plant's people gave it to."""

from __future__ import annotations

import hashlib
import hmac
import ipaddress
import socket
import ssl
from dataclasses import dataclass
from pathlib import Path

from hil.modbus.tls import own_certificate
from recordings import BadInput

DEFAULT_HOST = "127.0.0.1"
LEAST_TOKEN = 16
"""Characters of the shortest token: nobody guesses one of them before the valve is worn out."""

COOKIE = "bristle_page"


@dataclass(frozen=True)
class PageSettings:
    """Where the page is served. address : ``[HOST:]PORT``, a port of 0 is any free one; expose : to other machines,
    which needs the next three; token : file with the secret that who looks has to know; certificate, key : PEM files;
    where : what a message names.
    """

    address: str = "0"
    expose: bool = False
    token: Path | None = None
    certificate: Path | None = None
    key: Path | None = None
    where: str = "page"

    def access(self) -> Access:
        """The settings with everything about them checked. Raises BadInput."""
        host, port = _host_and_port(self.address, self.where)
        if not self.expose:
            if not _is_loopback(host):
                remedy = "give 127.0.0.1, or expose it with a token and TLS"
                raise BadInput(self.where, f"other machines can reach {host}", remedy, parameter="expose")
            return Access(host, port, where=self.where)
        if self.token is None or self.certificate is None or self.key is None:
            files = (("page_token", self.token), ("page_cert", self.certificate), ("page_key", self.key))
            missing = tuple(name for name, given in files if given is None)
            found = "other machines may look only with a token and over TLS"
            raise BadInput(self.where, found, "give files of a token, a certificate and its key", parameter=missing)
        access = Access(host, port, _token(self.token), self.certificate, self.key, self.where)
        access.tls()
        return access


@dataclass(frozen=True)
class Access:
    """Checked settings. token : None on loopback; certificate, key : files, None on loopback."""

    host: str
    port: int
    token: str | None = None
    certificate: Path | None = None
    key: Path | None = None
    where: str = "page"

    def __repr__(self) -> str:
        return f"<Access to {self.host}:{self.port}{' with a token and TLS' if self.token else ''}>"

    def tls(self) -> ssl.SSLContext | None:
        """What the server shows itself with; None on loopback. Raises BadInput."""
        if self.certificate is None or self.key is None:
            return None
        return own_certificate(self.certificate, self.key)

    def bound(self) -> socket.socket:
        """A socket that listens there. Raises BadInput when it cannot."""
        family = socket.AF_INET6 if ":" in self.host else socket.AF_INET
        try:
            return socket.create_server((self.host, self.port), family=family, backlog=64)
        except OSError as error:
            found = f"{self.host}:{self.port} cannot be used ({error.strerror or error})"
            raise BadInput(self.where, found, "give another port, or 0 for a free one") from None

    def url(self, port: int) -> str:
        """The address of the page on the port that was bound."""
        host = {"0.0.0.0": socket.gethostname(), "::": socket.gethostname()}.get(self.host, self.host)
        return f"{'https' if self.token else 'http'}://{f'[{host}]' if ':' in host else host}:{port}/"

    def knows(self, token: str) -> bool:
        """Whether this is the token, in a time that tells nothing about it."""
        return self.token is not None and hmac.compare_digest(token.encode(), self.token.encode())

    def cookie(self) -> str:
        """What a browser shows once it has shown the token: it outlives a restart of the page, not a new token."""
        return hmac.new((self.token or "").encode(), b"the page of the monitor, version 1", hashlib.sha256).hexdigest()

    def admits(self, cookie: str | None) -> bool:
        """Whether a browser with this cookie may look."""
        return self.token is None or (
            cookie is not None and hmac.compare_digest(cookie.encode(), self.cookie().encode())
        )


def _host_and_port(address: str, where: str) -> tuple[str, int]:
    host, _, port = address.rpartition(":")
    host = host.removeprefix("[").removesuffix("]")
    if not port.isdecimal() or not port.isascii() or int(port) > 65535 or any(c in host for c in "/@ "):
        raise BadInput(where, f"'{address}' is no [HOST:]PORT", "write for example 5006 or 127.0.0.1:5006")
    return host or DEFAULT_HOST, int(port)


def _is_loopback(host: str) -> bool:
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def _token(path: Path) -> str:
    """The first line of a file."""
    try:
        lines = path.read_text(encoding="ascii").splitlines()
    except OSError as error:
        found = f"the token cannot be read: {error.strerror}"
        raise BadInput(str(path), found, "give another file", parameter="page_token") from None
    except UnicodeDecodeError:
        raise BadInput(str(path), "the token has other signs than ASCII", "use letters and digits") from None
    token = lines[0].strip() if lines else ""
    if len(token) < LEAST_TOKEN:
        found = f"the token has {len(token)} characters, and needs {LEAST_TOKEN} at least"
        raise BadInput(str(path), found, "make one with: openssl rand -hex 32")
    return token
