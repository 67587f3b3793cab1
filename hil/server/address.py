"""Where a server listens, as the user writes it: ``tcp://127.0.0.1:5020``, ``rtu:/dev/ttyS0``, ``pty:`` and so on."""

from __future__ import annotations

import ipaddress
import socket
from dataclasses import dataclass
from typing import Literal
from urllib.parse import parse_qsl, urlsplit

from recordings import BadInput

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
class SerialAddress:
    """A serial line: device, speed [Bd], parity N, E or O, stop bits; the defaults are those of the Modbus standard."""

    device: str
    baud: int = 19200
    parity: str = "E"
    stop_bits: int = 1


@dataclass(frozen=True)
class PtyAddress:
    """A pseudo terminal made for the purpose; `link` is a name to give it, or empty."""

    link: str = ""


ServerAddress = NetworkAddress | SerialAddress | PtyAddress


def listen_address(text: str) -> ServerAddress:
    """Read an address. Raises BadInput saying which forms there are.

    >>> listen_address("tcp://localhost:0")
    NetworkAddress(kind='tcp', host='127.0.0.1', port=0)
    >>> listen_address("rtu:/dev/ttyUSB0?baud=9600&parity=N").baud
    9600
    """
    scheme = text.split(":", 1)[0]
    if scheme in {"tcp", "tls"}:
        return _network(text)
    if scheme == "rtu":
        return _serial(text)
    if text.startswith("pty:"):
        return PtyAddress(text.removeprefix("pty:").removeprefix("//"))
    raise _bad(text, "is not an address to listen on")


def _network(text: str) -> NetworkAddress:
    try:
        parts = urlsplit(text)
        host, port = parts.hostname, parts.port
    except ValueError as error:
        raise _bad(text, f"cannot be understood ({error})") from None
    if not host or port is None or parts.path or parts.query or parts.username:
        raise _bad(text, "is not host and port")
    return NetworkAddress("tls" if parts.scheme == "tls" else "tcp", _numeric(text, host), port)


def _numeric(text: str, host: str) -> str:
    """The numeric address of a host: what is checked to be loopback is then what is listened on."""
    try:
        found = socket.getaddrinfo(host, None, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE)
    except OSError as error:
        raise _bad(text, f"has no host that is known here ({error.strerror or error})") from None
    numbers = [str(entry[4][0]) for entry in found]
    return next((number for number in numbers if ":" not in number), numbers[0])


def _serial(text: str) -> SerialAddress:
    device, _, query = text.removeprefix("rtu:").removeprefix("//").partition("?")
    options = dict(parse_qsl(query, keep_blank_values=True))
    unknown = sorted(set(options) - {"baud", "parity", "stop"})
    if not device or unknown:
        raise _bad(text, f"has the unknown option {unknown[0]!r}" if unknown else "names no serial device")
    baud, parity, stop = options.get("baud", "19200"), options.get("parity", "E").upper(), options.get("stop", "1")
    if (
        not (baud.isdecimal() and 50 <= int(baud) <= 4_000_000)
        or parity not in {"N", "E", "O"}
        or stop not in {"1", "2"}
    ):
        raise _bad(text, "has an option out of range (baud 50 to 4000000, parity N, E or O, stop 1 or 2)")
    return SerialAddress(device, int(baud), parity, int(stop))


def _bad(text: str, found: str) -> BadInput:
    return BadInput("--listen", f"{text!r} {found}", f"use one of: {FORMS}")
