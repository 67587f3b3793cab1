"""The address of a source: one line of text says where the values come from and how.

    tcp://HOST:PORT                                    Modbus TCP; port 502 when not given
    tls://HOST:PORT?ca=..&cert=..&key=..               Modbus/TCP Security, both sides show certificates; port 802
    rtu:/dev/ttyUSB0?baud=19200&parity=E               Modbus RTU on a serial line
    replay:REC.h5?pace=1                               a recording played back; without pace as fast as possible

All live ones take `timeout` [s], and rtu takes `stop` bits and `quiet` [s], the silence after a fault.
"""

from __future__ import annotations

import difflib
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import parse_qsl, urlsplit

from recordings import BadInput

TIMEOUT_S = 0.5
_FORMS = "tcp://HOST:PORT, tls://HOST:PORT?ca=..&cert=..&key=.., rtu:DEVICE?baud=..&parity=.. or replay:REC.h5"


@dataclass(frozen=True)
class TcpAddress:
    """A Modbus TCP server. timeout : s to wait for a reply."""

    text: str
    host: str
    port: int = 502
    timeout: float = TIMEOUT_S


@dataclass(frozen=True)
class TlsAddress:
    """A Modbus/TCP Security server.

    ca, cert, key : PEM files; name : what the server's certificate must be issued to, when that is not `host`.
    """

    text: str
    host: str
    ca: Path
    cert: Path
    key: Path
    port: int = 802
    name: str | None = None
    timeout: float = TIMEOUT_S


@dataclass(frozen=True)
class RtuAddress:
    """A serial line. quiet : s of silence after a fault, longer than the slowest reply is late."""

    text: str
    device: Path
    baud: int = 19200
    parity: str = "E"
    stop: int = 1
    timeout: float = TIMEOUT_S
    quiet: float = TIMEOUT_S

    @property
    def gap(self) -> float:
        """The silence that ends a frame [s]: 3.5 characters, on fast lines 1.75 ms.

        Modbus over Serial Line 1.02, section 2.5.1.1.
        """
        bits = 9 + (self.parity != "N") + self.stop
        return 3.5 * bits / self.baud if self.baud <= 19200 else 1.75e-3


@dataclass(frozen=True)
class ReplayAddress:
    """A recording. pace : times real time; None plays as fast as possible."""

    text: str
    path: Path
    pace: float | None = None


LiveAddress = TcpAddress | TlsAddress | RtuAddress
Address = LiveAddress | ReplayAddress


def parse_address(text: str) -> Address:
    """The address that a text means. Raises BadInput naming what is wrong in it.

    >>> parse_address("rtu:/dev/ttyUSB0?baud=9600&parity=N").gap
    0.0036458333333333334
    >>> parse_address("tcp://10.0.0.7").port
    502
    """
    scheme, colon, rest = text.partition(":")
    readers: Mapping[str, Callable[[str, str, _Options], Address]]
    readers = {"tcp": _tcp, "tls": _tls, "rtu": _rtu, "replay": _replay}
    if not colon or scheme not in readers:
        raise BadInput(text, f"'{scheme}' is not a kind of source", f"write {_FORMS}")
    place, _, query = rest.partition("?")
    return readers[scheme](text, place, _Options(text, query))


class _Options:
    """What follows the question mark; every one must be taken."""

    def __init__(self, text: str, query: str) -> None:
        self._text = text
        try:
            pairs = parse_qsl(query, keep_blank_values=True, strict_parsing=bool(query))
        except ValueError:
            raise BadInput(text, f"'{query}' are not options", "write name=value, joined by '&'") from None
        self._given: Mapping[str, str] = dict(pairs)
        if len(self._given) < len(pairs):
            raise BadInput(text, "an option is given twice", "give each option once")

    def only(self, *names: str) -> None:
        """Refuse any other option."""
        for name in self._given:
            if name not in names:
                near = difflib.get_close_matches(name, names, 1)
                remedy = f"did you mean '{near[0]}'?" if near else f"allowed: {', '.join(names)}"
                raise BadInput(self._text, f"the option '{name}' is not known", remedy)

    def number(self, name: str, default: float, lowest: float, highest: float) -> float:
        """An option that is a number in a range."""
        try:
            value = float(self._given.get(name, default))
        except ValueError:
            value = math.nan
        if not lowest <= value <= highest:
            found = f"{name} is '{self._given.get(name)}'"
            raise BadInput(self._text, found, f"{name} is a number from {lowest:g} to {highest:g}")
        return value

    def whole(self, name: str, default: int, lowest: int, highest: int) -> int:
        """An option that is a whole number in a range."""
        value = self.number(name, default, lowest, highest)
        if value != int(value):
            raise BadInput(self._text, f"{name} is {value:g}", f"{name} is a whole number from {lowest} to {highest}")
        return int(value)

    def choice(self, name: str, default: str, allowed: str) -> str:
        """An option that is one letter of `allowed`."""
        value = self._given.get(name, default).upper()
        if len(value) != 1 or value not in allowed:
            raise BadInput(self._text, f"{name} is '{self._given[name]}'", f"{name} is one of {', '.join(allowed)}")
        return value

    def text(self, name: str) -> str | None:
        """An option that is any text."""
        return self._given.get(name)

    def needed(self, name: str, what: str) -> str:
        """An option that must be there."""
        value = self._given.get(name)
        if not value:
            raise BadInput(self._text, f"the option '{name}' is missing", f"add {name}={what}")
        return value


def _host(text: str, place: str, port: int) -> tuple[str, int]:
    try:
        parts = urlsplit(place, allow_fragments=False)
        host, port = parts.hostname or "", parts.port if parts.port is not None else port
    except ValueError:
        raise BadInput(text, "the port is not a number from 1 to 65535", f"write {_FORMS}") from None
    if not host or not place.startswith("//") or parts.path not in ("", "/") or parts.username is not None:
        raise BadInput(text, "there is no host and port in it", f"write {_FORMS}")
    if port == 0:
        raise BadInput(text, "port 0 means no port", "give the port of the server, 1 to 65535")
    return host, port


def _tcp(text: str, place: str, options: _Options) -> TcpAddress:
    options.only("timeout")
    host, port = _host(text, place, 502)
    return TcpAddress(text, host, port, _timeout(options))


def _tls(text: str, place: str, options: _Options) -> TlsAddress:
    options.only("ca", "cert", "key", "name", "timeout")
    host, port = _host(text, place, 802)
    what = {"ca": "the certificate to trust", "cert": "our certificate", "key": "our private key"}
    ca, cert, key = (Path(options.needed(name, f"FILE.pem ({words})")) for name, words in what.items())
    return TlsAddress(text, host, ca, cert, key, port, options.text("name"), _timeout(options))


def _rtu(text: str, place: str, options: _Options) -> RtuAddress:
    options.only("baud", "parity", "stop", "timeout", "quiet")
    if not place or place.startswith("//"):
        raise BadInput(text, "there is no serial device in it", f"write {_FORMS}")
    timeout = _timeout(options)
    return RtuAddress(
        text,
        device=Path(place),
        baud=options.whole("baud", 19200, 50, 4_000_000),
        parity=options.choice("parity", "E", "NEO"),
        stop=options.whole("stop", 1, 1, 2),
        timeout=timeout,
        quiet=options.number("quiet", timeout, 1e-3, 600.0),
    )


def _replay(text: str, place: str, options: _Options) -> ReplayAddress:
    options.only("pace")
    if not place:
        raise BadInput(text, "there is no recording in it", f"write {_FORMS}")
    pace = options.number("pace", 1.0, 1e-3, 1e6) if options.text("pace") is not None else None
    return ReplayAddress(text, Path(place), pace)


def _timeout(options: _Options) -> float:
    return options.number("timeout", TIMEOUT_S, 1e-3, 60.0)
