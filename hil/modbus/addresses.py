"""The grammar of an address, one for whoever connects and whoever listens.

::

    address    transport ":" place ["?" options]
    transport  "tcp" | "tls" | "rtu" | others that the reader knows
    place      "//" host [":" port]         tcp, tls
               device                       rtu: /dev/ttyUSB0, also ///dev/ttyUSB0
    options    name "=" value {"&" name "=" value}

`AddressParts.of` splits a text, and `host_and_port` and `serial_line` read a place. What a source may be is said by the
transports in `hil.client`, where a server may listen in `hil.server.address`. Every mistake is a `BadInput` about the
whole text.
"""

from __future__ import annotations

import difflib
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from urllib.parse import parse_qsl, urlsplit

from recordings import BadInput

TIMEOUT_S = 0.5


@dataclass(frozen=True)
class SerialLine:
    """A serial line: device, speed [Bd], parity N, E or O, stop bits; the defaults are those of the Modbus standard."""

    device: str
    baud: int = 19200
    parity: str = "E"
    stop: int = 1

    @property
    def gap(self) -> float:
        """The silence that ends a frame [s]: 3.5 characters, on fast lines 1.75 ms.

        Modbus over Serial Line 1.02, section 2.5.1.1.
        """
        bits = 9 + (self.parity != "N") + self.stop
        return 3.5 * bits / self.baud if self.baud <= 19200 else 1.75e-3


@dataclass(frozen=True)
class AddressParts:
    """An address taken apart. text : the whole of it."""

    text: str
    transport: str
    place: str
    options: Options

    @classmethod
    def of(cls, text: str) -> AddressParts:
        """Split a text; nothing in it is judged but the form of the options. Raises BadInput.

        >>> parts = AddressParts.of("rtu:/dev/ttyS0?baud=9600")
        >>> parts.transport, parts.place, parts.options.number("baud", 19200, 50, 4e6)
        ('rtu', '/dev/ttyS0', 9600.0)
        """
        transport, colon, rest = text.partition(":")
        place, _, query = rest.partition("?")
        return cls(text, transport if colon else "", place, Options.of(text, query))


@dataclass(frozen=True)
class Options:
    """What follows the question mark: every option once. text : the address that they belong to."""

    text: str
    given: Mapping[str, str]

    @classmethod
    def of(cls, text: str, query: str) -> Options:
        """Options from ``name=value&name=value``. Raises BadInput."""
        try:
            pairs = parse_qsl(query, keep_blank_values=True, strict_parsing=bool(query))
        except ValueError:
            raise BadInput(text, f"'{query}' are not options", "write name=value, joined by '&'") from None
        given = dict(pairs)
        if len(given) < len(pairs):
            raise BadInput(text, "an option is given twice", "give each option once")
        return cls(text, given)

    def only(self, *names: str) -> None:
        """Refuse any other option."""
        for name in self.given:
            if name not in names:
                raise BadInput(self.text, f"the option '{name}' is not known", _instead(name, names))

    def number(self, name: str, default: float, lowest: float, highest: float) -> float:
        """An option that is a number in a range."""
        try:
            value = float(self.given.get(name, default))
        except ValueError:
            value = math.nan
        if not lowest <= value <= highest:
            found = f"{name} is '{self.given.get(name)}'"
            raise BadInput(self.text, found, f"{name} is a number from {lowest:g} to {highest:g}")
        return value

    def whole(self, name: str, default: int, lowest: int, highest: int) -> int:
        """An option that is a whole number in a range."""
        value = self.number(name, default, lowest, highest)
        if value != int(value):
            raise BadInput(self.text, f"{name} is {value:g}", f"{name} is a whole number from {lowest} to {highest}")
        return int(value)

    def choice(self, name: str, default: str, allowed: str) -> str:
        """An option that is one letter of `allowed`."""
        value = self.given.get(name, default).upper()
        if len(value) != 1 or value not in allowed:
            raise BadInput(self.text, f"{name} is '{self.given[name]}'", f"{name} is one of {', '.join(allowed)}")
        return value

    def word(self, name: str) -> str | None:
        """An option that is any text; None when it is not given."""
        return self.given.get(name)

    def needed(self, name: str, what: str) -> str:
        """An option that must be there."""
        value = self.given.get(name)
        if not value:
            raise BadInput(self.text, f"the option '{name}' is missing", f"add {name}={what}")
        return value


def _instead(name: str, names: Sequence[str]) -> str:
    near = difflib.get_close_matches(name, names, 1)
    if near:
        return f"did you mean '{near[0]}'?"
    return f"allowed: {', '.join(names)}" if names else "this kind of address has no options"


def host_and_port(parts: AddressParts, forms: str, port: int | None = None, lowest: int = 1) -> tuple[str, int]:
    """The host and the port of ``//HOST:PORT``. Raises BadInput.

    forms : what an address looks like, for the message; port : when none is given, None when there must be one;
    lowest : the lowest port, 0 where the system may choose one.
    """
    try:
        split = urlsplit(parts.place, allow_fragments=False)
        host, port = split.hostname or "", split.port if split.port is not None else port
    except ValueError:
        raise BadInput(parts.text, f"the port is not a number from {lowest} to 65535", f"write {forms}") from None
    bare = parts.place.startswith("//") and split.path in ("", "/") and split.username is None
    if not host or port is None or not bare:
        raise BadInput(parts.text, "there is no host and port in it", f"write {forms}")
    if port < lowest:
        raise BadInput(parts.text, "port 0 means no port", "give the port of the server, 1 to 65535")
    return host, port


def serial_line(parts: AddressParts, forms: str) -> SerialLine:
    """The serial line of a device and its options baud, parity and stop. Raises BadInput."""
    device = parts.place.removeprefix("//") if parts.place.startswith("///") else parts.place
    if not device or device.startswith("//"):
        raise BadInput(parts.text, "there is no serial device in it", f"write {forms}")
    return SerialLine(
        device,
        baud=parts.options.whole("baud", 19200, 50, 4_000_000),
        parity=parts.options.choice("parity", "E", "NEO"),
        stop=parts.options.whole("stop", 1, 1, 2),
    )
