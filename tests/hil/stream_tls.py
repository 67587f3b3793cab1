"""The peer of `stream_peer` behind TLS, with the handshake and the records of the library, and a cable in memory."""

from __future__ import annotations

import asyncio
import ssl
from asyncio.sslproto import SSLProtocol
from collections.abc import Callable
from random import Random
from typing import Any

from stream_peer import Sending, StreamPeer

REQUEST_BYTES = 12


class CableEnd(asyncio.Transport):
    """One end of a cable: what is written here comes to the other end at once, cut somewhere."""

    _start_tls_compatible = True

    def __init__(self, random: Random) -> None:
        super().__init__()
        self.protocol: Any = None
        self.other: CableEnd = self
        self._random, self._open = random, True

    def write(self, data: Any) -> None:
        place = self._random.randint(0, len(data))
        for piece in (bytes(data[:place]), bytes(data[place:])):
            asyncio.get_running_loop().call_soon(self.other.arrive, piece)

    def arrive(self, data: bytes) -> None:
        """Bytes from the other end."""
        while data and self._open:
            buffer = self.protocol.get_buffer(len(data))
            n_bytes = min(len(buffer), len(data))
            buffer[:n_bytes], data = data[:n_bytes], data[n_bytes:]
            self.protocol.buffer_updated(n_bytes)

    def close(self) -> None:
        self._force_close(None)

    abort = close

    def _force_close(self, error: BaseException | None) -> None:
        for end in (self, self.other):
            if end._open:
                end._open = False
                asyncio.get_running_loop().call_soon(end.protocol.connection_lost, error)

    def is_closing(self) -> bool:
        return not self._open

    def get_write_buffer_size(self) -> int:
        return 0


class Served(asyncio.Protocol):
    """What the peer hears and says over TLS, request by request."""

    def __init__(self, answering: Callable[[Sending], StreamPeer]) -> None:
        self._answering, self._pending = answering, b""

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        assert isinstance(transport, asyncio.Transport)
        self.peer = self._answering(Sending(transport))

    def data_received(self, data: bytes) -> None:
        self._pending += data
        while len(self._pending) >= REQUEST_BYTES:
            self.peer.write(self._pending[:REQUEST_BYTES])
            self._pending = self._pending[REQUEST_BYTES:]


async def connected(
    wire: asyncio.Protocol,
    answering: Callable[[Sending], StreamPeer],
    client: ssl.SSLContext,
    server: ssl.SSLContext,
    random: Random,
) -> StreamPeer:
    """Both sides after the handshake. answering : makes the peer of a connection."""
    loop, served = asyncio.get_running_loop(), Served(answering)
    near, far = CableEnd(random), CableEnd(random)
    near.other, far.other = far, near
    shaken = [loop.create_future() for _ in range(2)]
    near.protocol = SSLProtocol(loop, wire, client, shaken[0], server_side=False, server_hostname="127.0.0.1")
    far.protocol = SSLProtocol(loop, served, server, shaken[1], server_side=True)
    far.protocol.connection_made(far)
    near.protocol.connection_made(near)
    await asyncio.gather(*shaken)
    return served.peer
