"""The verdict on a reply does not depend on how the stream is cut, nor on the pauses: the right value or none.

Development seeds: 1 to 4.
"""

from __future__ import annotations

import asyncio
import os
from collections import Counter
from collections.abc import Awaitable, Callable, Sequence
from itertools import count, product
from random import Random

import pytest
from link_peers import in_virtual_time
from stream_peer import Faults, Piece, StreamPeer, Verdicts, rtu_frame, tcp_frame, words_of
from stream_tls import connected

from hil import parse_address
from hil.client.rtu import RtuAddress, RtuWire
from hil.client.tcp import CLEAN_REPLIES, TcpWire
from hil.modbus.checks import transactions
from hil.modbus.messages import Reply, ReplyFault, Request
from hil.testing import LoopbackAuthority, make_loopback_authority

TIMEOUT, QUIET = 0.05, 0.1
Stream = Callable[[bytes, bytes, int], Sequence[Piece]]


def tcp(stream: Stream) -> tuple[TcpWire, StreamPeer]:
    wire = TcpWire(TIMEOUT, transactions(), Counter(), lambda error: None)
    peer = StreamPeer(wire, False, stream)
    wire.connection_made(peer)
    return wire, peer


def rtu(stream: Stream) -> tuple[RtuWire, StreamPeer]:
    wire = RtuWire(TIMEOUT, QUIET, 0.00175, Counter(), lambda error: None)
    peer = StreamPeer(wire, True, stream)
    wire.connection_made(peer)
    return wire, peer


async def asked(wire: TcpWire | RtuWire, peer: StreamPeer, address: int, count: int = 3) -> tuple[Reply, bool]:
    """The verdict on a read, and whether it is a wrong value taken for good."""
    reply = await wire.exchange(Request(unit=1, function=3, address=address, count=count))
    wrong = reply.fault is None and reply.words != words_of(peer.number_of[address, count], count)
    return reply, wrong


# Each way to fill up a reply that lost its end


def foreign_tcp(random: Random) -> bytes:
    return tcp_frame(random.randrange(1 << 16), 1, 3, words_of(random.randrange(1 << 20), random.randint(15, 25)))


def foreign_rtu(random: Random) -> bytes:
    """Of another device: one of the same device and form is what nobody could tell on a serial line."""
    return rtu_frame(random.randint(2, 9), 3, words_of(random.randrange(1 << 20), random.randint(1, 6)))


async def filled_up(n_before: int, lost: int, filling: str, cut: int, pause: float) -> bool:
    """One reply loses its last bytes, another frame follows and is cut once; whether a wrong value is believed."""
    at = count()

    def stream(reply: bytes, before: bytes, number: int) -> list[Piece]:
        if len(reply) < 15 or next(at) != n_before:
            return [Piece(0.0, reply)]
        behind = {"before": before, "foreign": tcp_frame(0x1234, 1, 3, (5, 6, 7)), "own": reply}[filling]
        whole = reply[:-lost] + behind
        return [Piece(0.0, whole[:cut]), Piece(pause, whole[cut:])]

    wire, peer = tcp(stream)
    return any([(await asked(wire, peer, 10 * k))[1] for k in range(n_before + 3)])


CUTS = range(1, 30)


@pytest.mark.parametrize("filling", ["before", "foreign", "own"])
@pytest.mark.parametrize("pause", [0.0, 0.002, 0.03, 0.2])
def test_a_reply_whose_end_is_lost_is_never_filled_up_by_what_comes_next(filling, pause):
    async def story() -> list[tuple[int, int]]:
        cases = product(range(1, 15), CUTS)
        return [case for case in cases if await filled_up(2, case[0], filling, case[1], pause)]

    assert in_virtual_time(story()) == []


def test_neither_on_a_connection_that_has_been_clean_for_long_by_the_reply_before():
    async def story() -> list[tuple[int, int]]:
        cases = product(range(1, 15), CUTS)
        return [case for case in cases if await filled_up(CLEAN_REPLIES + 5, case[0], "before", case[1], 0.002)]

    assert in_virtual_time(story()) == []


def test_a_reply_in_pieces_is_believed_when_the_next_answer_stands_behind_it():
    async def story() -> list[ReplyFault | None]:
        wire, peer = tcp(lambda reply, before, number: [Piece(0.001, reply[k : k + 1]) for k in range(len(reply))])
        return [(await asked(wire, peer, 10 * k))[0].fault for k in range(30)]

    assert in_virtual_time(story()) == [None] * 30


def test_a_clean_connection_is_soon_believed_without_a_proof():
    async def story() -> int:
        wire, peer = tcp(lambda reply, before, number: [Piece(0.0, reply)])
        for k in range(100):
            await asked(wire, peer, 10 * k)
        return peer.n_requests - 100

    n_proofs = in_virtual_time(story())
    assert CLEAN_REPLIES <= n_proofs < CLEAN_REPLIES + 25  # the ends of some replies look like an id of late


# Faults combined

LENGTHS = (3, 4, 60, 5)
"""On a serial line no two reads in a row have one length: a reply in the place of a lost one of the same form is what
nobody could tell there.
"""


Opened = Callable[[Stream], Awaitable[tuple[TcpWire | RtuWire, StreamPeer]]]
"""A connection to the peer that sends that stream."""


@pytest.fixture(scope="module")
def authority(tmp_path_factory: pytest.TempPathFactory) -> LoopbackAuthority:
    return make_loopback_authority(tmp_path_factory.mktemp("authority"))


@pytest.fixture
def opened(transport: str, authority: LoopbackAuthority) -> Opened:
    """How a connection is opened on the transport that a test is for."""
    client, server = authority.client.client_context(), authority.server.server_context()
    random = Random(transport)

    async def tls(stream: Stream) -> tuple[TcpWire, StreamPeer]:
        def lost(error: BaseException | None) -> None:
            peer.gone = True

        wire = TcpWire(TIMEOUT, transactions(), Counter(), lost)
        peer = await connected(wire, lambda sending: StreamPeer(sending, False, stream), client, server, random)
        return wire, peer

    async def plain(stream: Stream) -> tuple[TcpWire | RtuWire, StreamPeer]:
        return rtu(stream) if transport == "rtu" else tcp(stream)

    return tls if transport == "tls" else plain


async def harmed_replies(transport: str, opened: Opened, n_replies: int, share: float, seed: int) -> Verdicts:
    """What became of so many replies of the peer."""
    random, serial = Random(seed), transport == "rtu"
    faults = Faults(random, share, TIMEOUT, QUIET, foreign_rtu if serial else foreign_tcp)
    wire, peer = await opened(faults)
    good, wrong, untold, before = 0, 0, 0, 0
    for k in count():
        if before + peer.n_requests >= n_replies:
            break
        if peer.gone:
            before += peer.n_requests
            wire, peer = await opened(faults)
        reply, is_wrong = await asked(wire, peer, 7 * k % 60_000, LENGTHS[k % 4] if serial else random.choice(LENGTHS))
        nobody_could = is_wrong and peer.untold(CLEAN_REPLIES)
        good, wrong, untold = good + (reply.fault is None), wrong + (is_wrong > nobody_could), untold + nobody_could
    wire.close()
    return Verdicts(before + peer.n_requests, faults.harmed, good, wrong, untold)


@pytest.mark.parametrize("transport", ["tcp", "tls", "rtu"])
@pytest.mark.parametrize("share", [0.05, 0.25, 0.6])
def test_three_faults_at_once_and_any_cut_give_no_wrong_value(transport, opened, share):
    found = in_virtual_time(harmed_replies(transport, opened, round(700 / share), share, seed=1))
    assert found.wrong == 0
    assert found.good > 70
    assert found.harmed > 600


# Devices that answer late


def default_line(stream: Stream) -> tuple[RtuWire, StreamPeer]:
    """A serial line with the default options."""
    address = parse_address("rtu:/dev/ttyS0")
    assert isinstance(address, RtuAddress)
    wire = RtuWire(address.timeout, address.quiet, address.line.gap, Counter(), lambda error: None, address.late)
    peer = StreamPeer(wire, True, stream)
    wire.connection_made(peer)
    return wire, peer


@pytest.mark.parametrize("lateness", [0.0, 0.45, 0.6, 1.2, 2.4, 4.9])
def test_a_slow_device_on_a_serial_line_is_given_more_time(lateness):
    """All reads have one form, so that each reply could pass for the next one's."""

    async def story() -> tuple[list[bool], list[bool]]:
        wire, peer = default_line(lambda reply, before, number: [Piece(lateness, reply)])
        found = [await asked(wire, peer, 10 * k) for k in range(40)]
        return [wrong for _, wrong in found], [reply.fault is None for reply, _ in found]

    wrong, good = in_virtual_time(story())
    assert not any(wrong)
    assert sum(good) >= 38


def test_a_device_that_is_late_now_and_then_never_gives_a_wrong_value():
    async def story(seed: int) -> tuple[bool, int]:
        random = Random(seed)
        lateness = [random.choice((0.0, 0.0, 0.02, random.uniform(0.3, 4.9))) for _ in range(500)]
        wire, peer = default_line(lambda reply, before, number: [Piece(lateness[number % 500], reply)])
        found = [await asked(wire, peer, 10 * k) for k in range(100)]
        return any(wrong for _, wrong in found), sum(reply.fault is None for reply, _ in found)

    for seed in range(20):
        wrong, good = in_virtual_time(story(seed))
        assert not wrong
        assert good > 60


def test_what_was_asked_before_the_line_was_opened_is_never_an_answer():
    async def story() -> list[bool]:
        wire, peer = default_line(lambda reply, before, number: [Piece(0.3, reply)])
        loop = asyncio.get_running_loop()
        loop.call_later(4.5, wire.data_received, rtu_frame(1, 3, words_of(9999, 3)))
        return [(await asked(wire, peer, 10 * k))[1] for k in range(5)]

    assert not any(in_virtual_time(story()))


@pytest.mark.long
@pytest.mark.parametrize("transport", ["tcp", "tls", "rtu"])
@pytest.mark.parametrize("share", [0.05, 0.25, 0.6])
def test_a_million_replies_with_three_faults_at_once(transport, opened, share):
    """BRISTLE_WIRE_REPLIES says how many replies of the peer each of the three shares has, a third of 10^6 by default,
    and BRISTLE_WIRE_SEED with which seed.
    """
    n_replies = int(os.environ.get("BRISTLE_WIRE_REPLIES", "334000"))
    seed = int(os.environ.get("BRISTLE_WIRE_SEED", "50000"))
    found = in_virtual_time(harmed_replies(transport, opened, n_replies, share, seed))
    print("in memory,", transport, f"share {share}:", found)
    assert found.wrong == 0
