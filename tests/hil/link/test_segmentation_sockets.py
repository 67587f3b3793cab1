"""The verdict on replies over real sockets, with TLS and without: the stream is harmed and cut before it is sent.

Development seed: 5.
"""

from __future__ import annotations

import asyncio
import os
import ssl
from collections import Counter
from collections.abc import AsyncIterator, Callable
from contextlib import AbstractAsyncContextManager, asynccontextmanager
from itertools import count
from random import Random
from time import monotonic

import pytest
from stream_peer import Faults, Sending, StreamPeer, Verdicts, rtu_frame, tcp_frame, words_of

from hil import parse_address
from hil.client.transport import LinkSide
from hil.modbus.checks import transactions
from hil.modbus.messages import Request
from hil.modbus.pty import PtyEnd
from hil.testing import LoopbackAuthority, make_loopback_authority

TIMEOUT, QUIET = 0.05, 0.1
REQUEST_BYTES, RTU_REQUEST_BYTES = 12, 8
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


class SendingOnLine(asyncio.Protocol):
    """The same on a serial line."""

    def __init__(self, line: PtyEnd) -> None:
        self._line = line

    def data_received(self, data: bytes) -> None:
        self._line.write(data)


def foreign(random: Random) -> bytes:
    return tcp_frame(random.randrange(1 << 16), 1, 3, words_of(random.randrange(1 << 20), random.randint(15, 25)))


def foreign_rtu(random: Random) -> bytes:
    return rtu_frame(random.randint(2, 9), 3, words_of(random.randrange(1 << 20), random.randint(1, 6)))


Addressed = Callable[[LoopbackAuthority, Faults, list[StreamPeer]], AbstractAsyncContextManager[str]]
"""(authority, faults, connections) -> the address at which the peer is served meanwhile."""


@asynccontextmanager
async def over_tls(authority: LoopbackAuthority, faults: Faults, connections: list[StreamPeer]) -> AsyncIterator[str]:
    client, context = authority.client, authority.server.server_context()
    async with await served(faults, connections, context) as server:
        files = f"ca={client.authority}&cert={client.certificate}&key={client.key}"
        yield f"tls://127.0.0.1:{server.sockets[0].getsockname()[1]}?{files}&timeout={TIMEOUT}"


@asynccontextmanager
async def over_tcp(authority: LoopbackAuthority, faults: Faults, connections: list[StreamPeer]) -> AsyncIterator[str]:
    async with await served(faults, connections, None) as server:
        yield f"tcp://127.0.0.1:{server.sockets[0].getsockname()[1]}?timeout={TIMEOUT}"


@asynccontextmanager
async def over_pty(authority: LoopbackAuthority, faults: Faults, connections: list[StreamPeer]) -> AsyncIterator[str]:
    pending = bytearray()

    def receive(data: bytes) -> None:
        pending.extend(data)
        while len(pending) >= RTU_REQUEST_BYTES:
            connections[0].write(bytes(pending[:RTU_REQUEST_BYTES]))
            del pending[:RTU_REQUEST_BYTES]

    with PtyEnd(receive) as line:
        connections.append(StreamPeer(SendingOnLine(line), True, faults))
        yield f"rtu:{line.path}?timeout={TIMEOUT}&quiet={QUIET}"


async def served(
    faults: Faults, connections: list[StreamPeer], context: ssl.SSLContext | None
) -> asyncio.AbstractServer:
    loop = asyncio.get_running_loop()
    return await loop.create_server(lambda: ServedStream(faults, connections), "127.0.0.1", 0, ssl=context)


async def harmed_replies(
    addressed: Addressed, authority: LoopbackAuthority, share: float, seed: int, enough: Callable[[int], bool]
) -> Verdicts:
    """What became of the peer's replies until there were enough."""
    random, connections, gone = Random(seed), list[StreamPeer](), asyncio.Event()
    serial = addressed is over_pty
    late, stranger = (QUIET, foreign_rtu) if serial else (TIMEOUT, foreign)
    faults = Faults(random, share, TIMEOUT, late, stranger)
    side, wire, good, wrong = LinkSide(transactions(), Counter(), lambda error: gone.set()), None, 0, 0
    async with addressed(authority, faults, connections) as address:
        opening = parse_address(address).opening()  # type: ignore[union-attr]
        for k in count():
            if connections and enough(connections[-1].n_requests):
                break
            if wire is None or gone.is_set():
                gone.clear()
                wire = await opening(side)
            # on a serial line no two reads in a row have one form
            place, n = 7 * k % 60_000, LENGTHS[k % 4] if serial else random.choice(LENGTHS)
            reply = await wire.exchange(Request(unit=1, function=3, address=place, count=n))
            good += reply.fault is None
            wrong += reply.fault is None and reply.words != words_of(connections[-1].number_of[place, n], n)
        if wire is not None:
            wire.close()
    return Verdicts(connections[-1].n_requests, faults.harmed, good, wrong)


@pytest.mark.slow
def test_three_faults_at_once_and_any_cut_give_no_wrong_value_over_tls(authority):
    found = asyncio.run(harmed_replies(over_tls, authority, 0.25, 100, lambda n_replies: n_replies >= 400))
    assert found.wrong == 0
    assert found.good > 100
    assert found.harmed > 60


@pytest.mark.long
@pytest.mark.parametrize("addressed", [over_tcp, over_tls, over_pty])
def test_as_many_replies_as_fit_into_the_time_over_real_sockets(authority, addressed):
    """BRISTLE_WIRE_SECONDS says how long, ten minutes by default."""
    end = monotonic() + float(os.environ.get("BRISTLE_WIRE_SECONDS", "600"))
    found = asyncio.run(harmed_replies(addressed, authority, 0.1, 60_010, lambda n_replies: monotonic() > end))
    print(addressed.__name__, found)
    assert found.wrong == 0
    assert found.good > 0
