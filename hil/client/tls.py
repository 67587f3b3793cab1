"""Modbus/TCP Security: the stream of `hil.client.tcp` under TLS, both sides showing certificates."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar, Self

from hil.client.tcp import open_stream
from hil.client.transport import LinkSide, LiveAddress, WireOpening, timeout_of
from hil.client.wire import Wire
from hil.modbus.addresses import AddressParts, host_and_port
from hil.modbus.tls import Certificates, is_certificate_trouble
from recordings import BadInput


@dataclass(frozen=True)
class TlsAddress(LiveAddress):
    """A Modbus/TCP Security server.

    ca, cert, key : PEM files; name : what the server's certificate must be issued to, when that is not `host`.
    """

    scheme: ClassVar[str] = "tls"
    form: ClassVar[str] = "tls://HOST:PORT?ca=..&cert=..&key=.."

    host: str
    ca: Path
    cert: Path
    key: Path
    port: int = 802
    name: str | None = None

    @classmethod
    def of(cls, parts: AddressParts) -> Self:
        """Read an address; port 802 when none is given."""
        options = parts.options
        options.only("ca", "cert", "key", "name", "timeout")
        host, port = host_and_port(parts, cls.form, 802)
        what = {"ca": "the certificate to trust", "cert": "our certificate", "key": "our private key"}
        ca, cert, key = (Path(options.needed(name, f"FILE.pem ({words})")) for name, words in what.items())
        return cls(parts.text, host, ca, cert, key, port, options.word("name"), timeout=timeout_of(parts))

    def opening(self) -> WireOpening:
        """Raises BadInput for certificates that cannot be used."""
        context = Certificates(self.cert, self.key, self.ca).client_context()

        async def opened(side: LinkSide) -> Wire:
            return await open_stream(self.host, self.port, self.timeout, side, context, self.name or self.host)

        return opened

    def refusal(self, error: BaseException | None) -> BadInput | None:
        """The two sides do not accept each other's certificates."""
        if not is_certificate_trouble(error):
            return None
        found = f"the two sides do not accept each other's certificates ({error})"
        return BadInput(self.text, found, "check ca, cert and name, and what the server trusts")
