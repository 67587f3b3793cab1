"""The verdict on replies over TLS: a real handshake on the loopback, the stream harmed and cut before it is encrypted.

Development seed: 5.
"""

from __future__ import annotations

import asyncio
from collections import Counter
from itertools import count
from random import Random

import pytest
from stream_peer import Faults, StreamPeer, tcp_frame, words_of

from hil import parse_address
from hil.client.tcp import TcpWire
from hil.client.transport import LinkSide
from hil.modbus.checks import transactions
from hil.modbus.messages import Request
from hil.testing import LoopbackAuthority, make_loopback_authority

TIMEOUT = 0.05
REQUEST_BYTES = 12
LENGTHS = (3, 4, 60, 5)


@pytest.fixture(scope="module")
def authority(tmp_path_factory: pytest.TempPathFactory) -> LoopbackAuthority:
    return make_loopback_authority(tmp_path_factory.mktemp("authority"))


class ServedStream(asyncio.Protocol):
    """One connection to the peer: its numbers go on over all of them."""

    def __init__(self, faults: Faults, connections: list[StreamPeer]) -> None:
        self._faults, self._connections, self._pending = faults, connections, b""

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        assert isinstance(transport, asyncio.Transport)
        peer = StreamPeer(Sending(transport), False, self._faults)
        if self._connections:
            peer.number_of, peer.n_requests = self._connections[-1].number_of, self._connections[-1].n_requests
        self._connections.append(peer)

    def data_received(self, data: bytes) -> None:
        self._pending += data
        while len(self._pending) >= REQUEST_BYTES:
            request, self._pending = self._pending[:REQUEST_BYTES], self._pending[REQUEST_BYTES:]
            self._connections[-1].write(request)


class Sending(asyncio.Protocol):
    """What the peer says goes out on a connection."""

    def __init__(self, transport: asyncio.Transport) -> None:
        self._transport = transport

    def data_received(self, data: bytes) -> None:
        if not self._transport.is_closing():
            self._transport.write(data)


def foreign(random: Random) -> bytes:
    return tcp_frame(random.randrange(1 << 16), 1, 3, words_of(random.randrange(1 << 20), random.randint(15, 25)))


async def harmed_replies(authority: LoopbackAuthority, n_harmed: int, seed: int) -> tuple[int, int]:
    """How many values were good, and how many of them wrong."""
    random, connections, gone = Random(seed), list[StreamPeer](), asyncio.Event()
    faults = Faults(random, 0.25, TIMEOUT, TIMEOUT, foreign)
    loop, client = asyncio.get_running_loop(), authority.client
    server = await loop.create_server(
        lambda: ServedStream(faults, connections), "127.0.0.1", 0, ssl=authority.server.server_context()
    )
    port = server.sockets[0].getsockname()[1]
    files = f"ca={client.authority}&cert={client.certificate}&key={client.key}"
    opening = parse_address(f"tls://127.0.0.1:{port}?{files}&timeout={TIMEOUT}").opening()  # type: ignore[union-attr]
    side, wire, good, wrong = LinkSide(transactions(), Counter(), lambda error: gone.set()), None, 0, 0
    async with server:
        for k in count():
            if faults.harmed >= n_harmed:
                break
            if wire is None or gone.is_set():
                gone.clear()
                wire = await opening(side)
                assert isinstance(wire, TcpWire)
            address, n = 7 * k % 60_000, random.choice(LENGTHS)
            reply = await wire.exchange(Request(unit=1, function=3, address=address, count=n))
            good += reply.fault is None
            wrong += reply.fault is None and reply.words != words_of(connections[-1].number_of[address, n], n)
        wire.close()
    return good, wrong


@pytest.mark.parametrize("n_harmed", [100, pytest.param(250_000, marks=pytest.mark.long)])
def test_three_faults_at_once_and_any_cut_give_no_wrong_value_over_tls(authority, n_harmed):
    good, wrong = asyncio.run(harmed_replies(authority, n_harmed, seed=n_harmed))
    assert wrong == 0
    assert good > n_harmed
