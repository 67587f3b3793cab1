"""What the wire library's servers leave open: lines that lost the thread, and function codes that nobody needs.

After half a frame the library waits for the other half, swallowing good requests as if they were it. Here a serial line
forgets what came before a silence, as the standard wants it, and a connection that speaks another protocol is closed.
"""

from __future__ import annotations

from collections.abc import Callable, Collection
from typing import Any

from pymodbus.constants import ExcCodes
from pymodbus.exceptions import NoSuchIdException
from pymodbus.pdu import ExceptionResponse, ModbusPDU
from pymodbus.server import ModbusSerialServer, ModbusTcpServer, ModbusTlsServer
from pymodbus.server.requesthandler import ServerRequestHandler

ALLOWED = frozenset({1, 2, 3, 4, 5, 6, 15, 16, 22, 23})
"""Function codes that read or write registers; all others (diagnostics, files, restarts) are refused."""

SILENCE = 0.05
"""A pause in a request on a serial line longer than this [s] is its end: 3.5 characters, and what adapters add."""

LONGEST = 260
"""Bytes of the longest frame on TCP."""


class _Handler(ServerRequestHandler):
    """One connection, or the serial line."""

    def __init__(self, server: Any, units: Collection[int], clock: Callable[[], float], serial: bool) -> None:
        super().__init__(server, None, self._look, None)  # type: ignore[no-untyped-call]
        self._units, self._clock, self._serial = units, clock, serial
        self._last = clock()

    def data_received(self, data: bytes) -> None:
        """Bytes from the peer, cut anywhere."""
        now = self._clock()
        if self._serial and now - self._last > SILENCE:
            self.recv_buffer = b""
        self._last = now
        super().data_received(data)
        if not self._serial and _lost(self.recv_buffer):
            self.close()

    def server_send(self, pdu: ModbusPDU | None, addr: Any) -> None:
        """Answer, unless another device on the line was asked."""
        if pdu is not None and not (self._serial and pdu.dev_id not in self._units):
            super().server_send(pdu, addr)  # type: ignore[no-untyped-call]

    def _look(self, sending: bool, pdu: ModbusPDU) -> ModbusPDU:
        """Let through what a unit of ours is asked and may be asked."""
        if sending or (pdu.dev_id in self._units and pdu.function_code in ALLOWED):
            return pdu
        return _Refused(pdu, pdu.dev_id in self._units)


class _Refused(ModbusPDU):
    """Stands in for a request that is not looked at."""

    def __init__(self, pdu: ModbusPDU, known_unit: bool) -> None:
        super().__init__(dev_id=pdu.dev_id, transaction_id=pdu.transaction_id)
        self.function_code = pdu.function_code & 0x7F
        self._known_unit = known_unit

    async def datastore_update(self, context: object, device_id: int) -> ModbusPDU:
        """A refusal; of a unit that is not there, silence on a line and a gateway's answer on TCP."""
        if not self._known_unit:
            raise NoSuchIdException(str(device_id))
        return ExceptionResponse(self.function_code, ExcCodes.ILLEGAL_FUNCTION)


def _lost(pending: bytes) -> bool:
    """Whether what is left over on a connection cannot be the beginning of a frame."""
    if len(pending) < 6:
        return pending[2:4].strip(b"\0") != b""
    return pending[2:4] != b"\0\0" or not 2 <= int.from_bytes(pending[4:6], "big") <= LONGEST - 6


class _Careful:
    """Goes in front of one of the library's servers. units : the ids that are served; clock : monotonic [s]."""

    serial = False

    def __init__(self, *what: Any, units: Collection[int], clock: Callable[[], float], **more: Any) -> None:
        self._units, self._clock = units, clock
        super().__init__(*what, **more)

    def callback_new_connection(self) -> _Handler:
        """The library asks for a handler of a connection."""
        return _Handler(self, self._units, self._clock, self.serial)


class CarefulTcpServer(_Careful, ModbusTcpServer):
    """Modbus TCP."""


class CarefulTlsServer(_Careful, ModbusTlsServer):
    """Modbus/TCP Security."""


class CarefulSerialServer(_Careful, ModbusSerialServer):
    """Modbus RTU."""

    serial = True
