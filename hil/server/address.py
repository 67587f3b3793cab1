"""Where a server listens, as the user writes it: ``tcp://127.0.0.1:5020``, ``rtu:/dev/ttyS0``, ``pty:`` and so on."""

from __future__ import annotations

import ipaddress
import socket
from dataclasses import dataclass
from typing import Literal

from hil.modbus.addresses import AddressParts, SerialLine, host_and_port, serial_line
from recordings import BadInput, BadParameter

FORMS = "tcp://127.0.0.1:5020, tls://127.0.0.1:8020, rtu:/dev/ttyS0?baud=19200&parity=N, pty: or pty:/tmp/valve"


@dataclass(frozen=True)
class NetworkAddress:
    """A TCP or TLS listener: `host` is a numeric address, `port` 0 lets the system choose."""

    kind: Literal["tcp", "tls"]
    host: str
    port: int

    @property
    def loopback(self) -> bool:
        """Whether only this machine can reach it."""
        return ipaddress.ip_address(self.host.split("%")[0]).is_loopback

    def at(self, port: int) -> str:
        """The address as written, with the port in use."""
        host = f"[{self.host}]" if ":" in self.host else self.host
        return f"{self.kind}://{host}:{port}"


@dataclass(frozen=True)
class PtyAddress:
    """A pseudo terminal made for the purpose; `link` is a name to give it, or empty."""

    link: str = ""


ServerAddress = NetworkAddress | SerialLine | PtyAddress


def listen_address(text: str) -> ServerAddress:
    """Read an address. Raises BadParameter saying which forms there are.

    >>> listen_address("tcp://localhost:0")
    NetworkAddress(kind='tcp', host='127.0.0.1', port=0)
    >>> listen_address("rtu:/dev/ttyUSB0?baud=9600&parity=N").baud
    9600
    """
    if text.partition(":")[0] not in {"tcp", "tls", "rtu", "pty"}:
        raise BadParameter("listen", text, "it is not an address to listen on", f"use one of: {FORMS}")
    try:
        return _read(AddressParts.of(text))
    except BadInput as error:
        raise BadParameter("listen", text, f"{error.found} ({error.remedy})", f"use one of: {FORMS}") from None


def _read(parts: AddressParts) -> ServerAddress:
    if parts.transport == "rtu":
        parts.options.only("baud", "parity", "stop")
        return serial_line(parts, "rtu:DEVICE")
    parts.options.only()
    if parts.transport == "pty":
        return PtyAddress(parts.place.removeprefix("//"))
    host, port = host_and_port(parts, "//HOST:PORT", lowest=0)
    return NetworkAddress("tls" if parts.transport == "tls" else "tcp", _numeric(host), port)


def _numeric(host: str) -> str:
    """The numeric address of a host: what is checked to be loopback is then what is listened on. Raises BadInput."""
    try:
        found = socket.getaddrinfo(host, None, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE)
    except OSError as error:
        raise BadInput(host, f"no such host is known here: {error.strerror or error}", "check its name") from None
    numbers = [str(entry[4][0]) for entry in found]
    return next((number for number in numbers if ":" not in number), numbers[0])
