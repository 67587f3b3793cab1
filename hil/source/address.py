"""The address of a source: one line of text says where the values come from and how.

    tcp://HOST:PORT                                    Modbus TCP; port 502 when not given
    tls://HOST:PORT?ca=..&cert=..&key=..               Modbus/TCP Security, both sides show certificates; port 802
    rtu:/dev/ttyUSB0?baud=19200&parity=E               Modbus RTU on a serial line
    replay:REC.h5?pace=1                               a recording played back; without pace as fast as possible

All live ones take `timeout` [s], and rtu takes `stop` bits and `quiet` [s], the silence after a fault.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

from hil.modbus.addresses import (
    TIMEOUT_S,
    AddressParts,
    LiveAddress,
    RtuAddress,
    TcpAddress,
    TlsAddress,
    host_and_port,
    serial_line,
)
from recordings import BadInput

_FORMS = "tcp://HOST:PORT, tls://HOST:PORT?ca=..&cert=..&key=.., rtu:DEVICE?baud=..&parity=.. or replay:REC.h5"


@dataclass(frozen=True)
class ReplayAddress:
    """A recording. pace : times real time; None plays as fast as possible."""

    text: str
    path: Path
    pace: float | None = None


Address = LiveAddress | ReplayAddress


def parse_address(text: str) -> Address:
    """The address that a text means. Raises BadInput naming what is wrong in it.

    >>> parse_address("rtu:/dev/ttyUSB0?baud=9600&parity=N").line.gap
    0.0036458333333333334
    >>> parse_address("tcp://10.0.0.7").port
    502
    """
    transport = text.partition(":")[0]
    if ":" not in text or transport not in _READERS:
        raise BadInput(text, f"'{transport}' is not a kind of source", f"write {_FORMS}")
    return _READERS[transport](AddressParts.of(text))


def _tcp(parts: AddressParts) -> TcpAddress:
    parts.options.only("timeout")
    host, port = host_and_port(parts, _FORMS, 502)
    return TcpAddress(parts.text, host, port, _timeout(parts))


def _tls(parts: AddressParts) -> TlsAddress:
    options = parts.options
    options.only("ca", "cert", "key", "name", "timeout")
    host, port = host_and_port(parts, _FORMS, 802)
    what = {"ca": "the certificate to trust", "cert": "our certificate", "key": "our private key"}
    ca, cert, key = (Path(options.needed(name, f"FILE.pem ({words})")) for name, words in what.items())
    return TlsAddress(parts.text, host, ca, cert, key, port, options.word("name"), _timeout(parts))


def _rtu(parts: AddressParts) -> RtuAddress:
    parts.options.only("baud", "parity", "stop", "timeout", "quiet")
    line, timeout = serial_line(parts, _FORMS), _timeout(parts)
    return RtuAddress(parts.text, line, timeout, quiet=parts.options.number("quiet", timeout, 1e-3, 600.0))


def _replay(parts: AddressParts) -> ReplayAddress:
    parts.options.only("pace")
    if not parts.place:
        raise BadInput(parts.text, "there is no recording in it", f"write {_FORMS}")
    pace = parts.options.number("pace", 1.0, 1e-3, 1e6) if parts.options.word("pace") is not None else None
    return ReplayAddress(parts.text, Path(parts.place), pace)


def _timeout(parts: AddressParts) -> float:
    return parts.options.number("timeout", TIMEOUT_S, 1e-3, 60.0)


_READERS: Mapping[str, Callable[[AddressParts], Address]] = {"tcp": _tcp, "tls": _tls, "rtu": _rtu, "replay": _replay}
