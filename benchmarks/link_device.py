"""A device for `benchmarks.link` in a process of its own: answers every read from memory, on TCP and a pseudo terminal.

python -m benchmarks.link_device 0          prints the port and the pseudo terminals, and serves until killed
"""

from __future__ import annotations

import asyncio
import os
import signal
import struct
import subprocess
import sys
import tty
from contextlib import suppress

from pymodbus.framer import FramerRTU

PIECE = 14
REGISTERS = struct.pack(">62f", *[12.5] * 62)


class Device:
    """The device process; `kill` and `start` make outages.

    port : of TCP; path, slow_path : pseudo terminals that answer at once, and as a line of 19200 Bd would.
    """

    def __init__(self) -> None:
        self.port, self.path, self.slow_path = 0, "", ""
        self.start()

    def start(self) -> None:
        """Start, at the same port as before."""
        command = [sys.executable, "-m", "benchmarks.link_device", str(self.port)]
        self._process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
        assert self._process.stdout is not None
        port, self.path, self.slow_path = self._process.stdout.readline().split()
        self.port = int(port)

    def kill(self) -> None:
        """End it at once."""
        self._process.send_signal(signal.SIGKILL)
        self._process.wait()


def reply(pdu: bytes) -> bytes:
    """The reply to a read of registers."""
    n_bytes = 2 * int.from_bytes(pdu[3:5], "big")
    return bytes([pdu[0], n_bytes]) + REGISTERS[:n_bytes]


class Connection(asyncio.Protocol):
    """Modbus TCP, as little of it as answers reads."""

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        assert isinstance(transport, asyncio.Transport)
        self._transport, self._pending = transport, b""

    def data_received(self, data: bytes) -> None:
        self._pending += data
        while len(self._pending) >= 12:
            frame, self._pending = self._pending[:12], self._pending[12:]
            answer = reply(frame[7:])
            self._transport.write(frame[:4] + (1 + len(answer)).to_bytes(2, "big") + frame[6:7] + answer)


def serve_line(baud: float | None) -> str:
    """Answer on a pseudo terminal, as slowly as a line of so many Bd, else at once; returns its name."""
    near, far = os.openpty()
    tty.setraw(near)
    tty.setraw(far)
    pending, loop = bytearray(), asyncio.get_running_loop()

    def on_request() -> None:
        with suppress(OSError):
            pending.extend(os.read(near, 4096))
        while len(pending) >= 8:
            body = bytes(pending[:1]) + reply(bytes(pending[1:6]))
            del pending[:8]
            frame = body + FramerRTU.compute_CRC(body).to_bytes(2, "big")
            for start in range(0, len(frame), PIECE):  # a receiver hands over a few characters at a time
                piece = frame[start : start + PIECE]
                loop.call_later(11 * (8 + start + len(piece)) / baud if baud else 0.0, os.write, near, piece)

    loop.add_reader(near, on_request)
    return os.ttyname(far)


async def main(port: int) -> None:
    """Serve until killed."""
    server = await asyncio.get_running_loop().create_server(Connection, "127.0.0.1", port)
    print(server.sockets[0].getsockname()[1], serve_line(None), serve_line(19200.0), flush=True)
    await server.serve_forever()


if __name__ == "__main__":
    asyncio.run(main(int(sys.argv[1])))
