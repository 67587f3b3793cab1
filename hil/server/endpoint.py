"""One listener of a server: opens a socket, a serial line or a pseudo terminal, or says in words why it cannot."""

from __future__ import annotations

import errno
import os
import socket
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass

from hil.modbus.addresses import SerialLine
from hil.modbus.pty import PtyLine
from hil.modbus.serial_line import check_serial_line, usable
from hil.modbus.terminals import TerminalError
from hil.modbus.tls import Certificates
from hil.server.address import NetworkAddress, PtyAddress, ServerAddress
from hil.server.handler import CarefulSerialServer, CarefulTcpServer, Room
from hil.server.unit import ServedUnit
from hil.server.wire import Clock, devices
from recordings import BadInput

_Server = CarefulTcpServer | CarefulSerialServer


@dataclass(frozen=True)
class Endpoint:
    """An open listener. address : where clients find it, with the port or the pseudo terminal that was chosen."""

    address: str
    _server: _Server
    _release: Callable[[], None]

    async def close(self) -> None:
        """Stop listening and drop the connections."""
        await self._server.shutdown()
        self._release()


async def open_endpoint(
    address: ServerAddress,
    units: Mapping[int, ServedUnit],
    clock: Clock,
    certificates: Certificates | None,
    room: Room | None = None,
) -> Endpoint:
    """Start to listen. room : for the connections, shared by a server's listeners. Raises BadInput where it cannot."""
    if isinstance(address, NetworkAddress):
        return await _open_network(address, units, clock, certificates, room)
    if isinstance(address, SerialLine):
        check_serial_line(f"rtu:{address.device}", address)
        server = _serial_server(address, units, clock)
        await _serve(server, address.device)
        return Endpoint(f"rtu:{address.device}", server, lambda: None)
    return await _open_pty(address, units, clock)


async def _open_network(
    address: NetworkAddress,
    units: Mapping[int, ServedUnit],
    clock: Clock,
    certificates: Certificates | None,
    room: Room | None,
) -> Endpoint:
    _try_network(address)
    tls = None
    if address.kind != "tcp":
        if certificates is None:
            remedy = "give certificate and private key of the server, and the authority of its clients"
            raise BadInput(address.at(address.port), "TLS needs certificates", remedy, parameter="certificates")
        tls = certificates.server_context()
    place = (address.host, address.port)
    server = CarefulTcpServer(devices(units, clock), address=place, units=units.keys(), clock=clock, room=room, tls=tls)
    await _serve(server, address.at(address.port))
    port = server.transport.sockets[0].getsockname()[1]  # type: ignore[attr-defined]
    return Endpoint(address.at(port), server, lambda: None)


async def _open_pty(address: PtyAddress, units: Mapping[int, ServedUnit], clock: Clock) -> Endpoint:
    """A pseudo terminal has no parity, and other clients than ours must be told: the address says so."""
    line = PtyLine()
    try:
        if address.link:
            _link(line.client_path, address.link)
        server = _serial_server(SerialLine(line.server_path), units, clock)
        await _serve(server, line.server_path)
    except BaseException:
        line.close()
        raise

    def release() -> None:
        line.close()
        if address.link and os.path.islink(address.link):
            with suppress(OSError):
                os.unlink(address.link)

    return Endpoint(f"rtu:{address.link or line.client_path}?parity=N", server, release)


def _serial_server(address: SerialLine, units: Mapping[int, ServedUnit], clock: Clock) -> CarefulSerialServer:
    return CarefulSerialServer(
        devices(units, clock),
        port=address.device,
        baudrate=address.baud,
        parity=usable(address).parity,
        stopbits=address.stop,
        ignore_missing_devices=True,  # on a line of several devices only the one that is meant may speak
        units=units.keys(),
        clock=clock,
    )


async def _serve(server: _Server, where: str) -> None:
    try:
        await server.serve_forever(background=True)
    except (RuntimeError, OSError, TerminalError) as error:
        raise BadInput(where, f"cannot listen there ({error})", "use another address") from None


def _try_network(address: NetworkAddress) -> None:
    """The wire library does not say why it cannot listen: ask the system first."""
    where, family = address.at(address.port), socket.AF_INET6 if ":" in address.host else socket.AF_INET
    try:
        with socket.socket(family, socket.SOCK_STREAM) as attempt:
            attempt.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            attempt.bind((address.host, address.port))
            attempt.listen()
    except OSError as error:
        reason = _REASONS.get(error.errno or 0, (f"{error.strerror}", "use another address"))
        raise BadInput(where, *reason) from None


_REASONS = {
    errno.EADDRINUSE: ("the port is in use", "stop the other program or use another port (0 takes a free one)"),
    errno.EACCES: ("ports below 1024 need privileges", "use a higher port such as 5020"),
    errno.EADDRNOTAVAIL: ("this machine has no such address", "use 127.0.0.1, or an address of this machine"),
}


def _link(path: str, link: str) -> None:
    try:
        os.symlink(path, link)
    except OSError as error:
        raise BadInput(f"pty:{link}", f"cannot make that link: {error.strerror}", "use a name that is free") from None
