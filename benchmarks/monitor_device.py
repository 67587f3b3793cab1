"""Valves for `benchmarks.monitor` in a process of their own: each read of a unit gives its next moment, from memory.

python -m benchmarks.monitor_device TABLE.npy        prints the port, and serves until killed
"""

from __future__ import annotations

import asyncio
import subprocess
import sys
from pathlib import Path

import numpy as np

MAP = """
name = "bench"
heartbeat = "counter"
[[points]]
name = "counter"
table = "input"
address = 0
type = "uint16"
[[points]]
name = "position"
table = "input"
address = 1
type = "float32"
unit = "m"
[[points]]
name = "setpoint"
table = "input"
address = 3
type = "float32"
unit = "1"
[[points]]
name = "pressure"
table = "input"
address = 5
type = "float32"
unit = "Pa"
"""


class Devices:
    """The process. table : (n_moments, 3), position [m], set point, pressure [Pa]."""

    def __init__(self, table: Path) -> None:
        command = [sys.executable, "-m", "benchmarks.monitor_device", str(table)]
        self._process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
        assert self._process.stdout is not None
        self.port = int(self._process.stdout.readline())

    def kill(self) -> None:
        """End it."""
        self._process.kill()
        self._process.wait()


class _Serving(asyncio.Protocol):
    def __init__(self, moments: list[bytes], counters: dict[int, int]) -> None:
        self._moments, self._counters = moments, counters

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        assert isinstance(transport, asyncio.Transport)
        self._transport, self._pending = transport, b""

    def data_received(self, data: bytes) -> None:
        self._pending += data
        while len(self._pending) >= 12:  # every request is a read
            frame, self._pending = self._pending[:12], self._pending[12:]
            unit = frame[6]
            n = self._counters[unit] = (self._counters.get(unit, 0) + 1) % 65536
            data = n.to_bytes(2, "big") + self._moments[n % len(self._moments)]
            head = frame[:4] + (3 + len(data)).to_bytes(2, "big") + bytes([unit, frame[7], len(data)])
            self._transport.write(head + data)


async def _serve(path: str) -> None:
    rows = np.load(path, allow_pickle=False).astype(">f4")
    moments, counters = [row.tobytes() for row in rows], dict[int, int]()
    loop = asyncio.get_running_loop()
    server = await loop.create_server(lambda: _Serving(moments, counters), "127.0.0.1", 0)
    print(server.sockets[0].getsockname()[1], flush=True)
    await server.serve_forever()


if __name__ == "__main__":
    asyncio.run(_serve(sys.argv[1]))
