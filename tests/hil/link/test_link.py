"""The link: it opens whenever the peer is there, notices a loss at once, and lets one silent device cost little."""

from __future__ import annotations

import asyncio
from collections import Counter
from itertools import pairwise
from random import Random

import pytest
from link_peers import TcpPeer, within

from hil import BackOff, LinkState, parse_address
from hil.client.link import DEAF_AFTER_S, OPEN_WITHIN_S, Link
from hil.client.state import REOPEN, REST, TRANSITIONS, Input, LinkPhase
from hil.client.tcp import TcpWire
from hil.modbus.messages import ReplyFault, Request

READ = Request(unit=1, function=3, address=0, count=2)


def constant(unit: int, function: int, address: int, count: int) -> list[int]:
    return [unit] * count


class Watched:
    """A link that runs, and what it said."""

    def __init__(self, address: str, **options: bool) -> None:
        self.said: asyncio.Queue[Input] = asyncio.Queue()
        self.link = Link(parse_address(address), lambda happening, text: self.said.put_nowait(happening), **options)

    async def __aenter__(self) -> Watched:
        self.task = asyncio.create_task(self.link.run())
        return self

    async def __aexit__(self, *_: object) -> None:
        self.task.cancel()
        await asyncio.gather(self.task, return_exceptions=True)

    async def until(self, happening: Input) -> None:
        while await within(self.said.get()) is not happening:
            pass


# The state machine


@pytest.mark.parametrize(
    ("inputs", "phases", "said"),
    [
        ("ANSWERED", "up", ["link_up"]),
        ("ANSWERED UNANSWERED ANSWERED", "up silent up", ["link_up"]),  # one lost reply is no outage
        ("ANSWERED UNANSWERED UNANSWERED", "up silent backoff", ["link_up", "link_down"]),
        (
            "UNANSWERED DUE UNANSWERED DUE ANSWERED",
            "backoff connecting backoff connecting up",
            ["link_down", "link_up"],
        ),
        ("LOST LOST LOST OPENED ANSWERED", "down down down connecting up", ["link_down", "link_up"]),
        ("ANSWERED LOST OPENED LOST", "up down connecting down", ["link_up", "link_down"]),
        ("ANSWERED LOST ANSWERED", "up down down", ["link_up", "link_down"]),  # a verdict that comes after the loss
    ],
)
def test_the_life_of_a_link(inputs, phases, said):
    state, announced, seen = LinkState(), [], []
    for name in inputs.split():
        state, news = state.after(Input[name])
        seen.append(state.phase.value)
        announced += [news] if news else []
    assert (" ".join(seen), announced) == (phases, said)


def test_from_every_phase_there_is_a_way_up_and_a_loss_is_always_down():
    for phase in LinkPhase:
        assert any(start is phase for start, _ in TRANSITIONS)
        assert LinkState(phase).after(Input.LOST)[0].phase is LinkPhase.DOWN
    assert {TRANSITIONS[start, happening] for start, happening in TRANSITIONS} == set(LinkPhase)


def test_up_and_down_are_announced_in_turn_whatever_happens():
    random = Random(3)
    state, announced = LinkState(), []
    for _ in range(10_000):
        state, news = state.after(random.choice(list(Input)))
        announced += [news] if news else []
    assert len(announced) > 100
    assert all(a != b for a, b in pairwise(announced))


def test_the_way_back_is_short_after_an_outage_of_any_length():
    for back_off in (REOPEN, REST):
        delays = [back_off.delay(n) for n in range(1, 100_000)]
        assert delays == sorted(delays)
        assert delays[-1] == back_off.cap
    assert OPEN_WITHIN_S + REOPEN.cap < 2.0  # an attempt that began just before the peer came back, and the next one
    assert BackOff(0.5, 0.5).delay(7) == 0.5


# ReportOpening and losing


def test_a_peer_that_is_absent_at_start_is_connected_to_when_it_comes():
    async def story() -> list[int]:
        peer = await TcpPeer(constant).start()
        await peer.stop()
        async with Watched(f"tcp://127.0.0.1:{peer.port}") as watched:
            for _ in range(3):  # attempts that fail
                await watched.until(Input.LOST)
            assert (await watched.link.exchange(READ)).fault is ReplyFault.LOST
            await peer.start()
            await watched.until(Input.OPENED)
            reply = await watched.link.exchange(READ)
            await peer.stop()
        return list(reply.words)

    assert asyncio.run(story()) == [1, 1]


def test_a_loss_ends_the_request_under_way_at_once():
    async def story() -> ReplyFault | None:
        peer = await TcpPeer(lambda *_: None).start()
        async with Watched(f"tcp://127.0.0.1:{peer.port}?timeout=60") as watched:
            await watched.until(Input.OPENED)
            asked = asyncio.create_task(watched.link.exchange(READ))
            await within(peer.asked.wait())
            peer.drop()
            reply = await within(asked, 10.0)  # the timeout is 60 s
            await watched.until(Input.LOST)
            await watched.until(Input.OPENED)  # and it is back
            await peer.stop()
        return reply.fault

    assert asyncio.run(story()) is ReplyFault.LOST


def test_a_link_that_is_ended_just_when_it_opens_ends():
    """Otherwise whoever closes the source waits for ever."""

    async def story() -> bool:
        def end(happening: Input, text: str) -> None:
            if happening is Input.OPENED:
                running.cancel()

        async with TcpPeer(constant) as peer:
            running = asyncio.create_task(Link(parse_address(f"tcp://127.0.0.1:{peer.port}"), end).run())
            await asyncio.wait([running], timeout=20.0)
            return running.cancelled()

    assert asyncio.run(story())


def test_a_connection_that_has_gone_deaf_is_opened_anew():
    async def story() -> int:
        async with TcpPeer(lambda *_: None) as peer, Watched(f"tcp://127.0.0.1:{peer.port}?timeout=0.05") as watched:
            await watched.until(Input.OPENED)
            while peer.n_connections < 2:
                await watched.link.exchange(READ)
                await asyncio.sleep(0.001)
            peer.answer = constant
            while (await within(watched.link.exchange(READ))).fault is not None:
                await asyncio.sleep(0.001)
            return peer.n_connections

    assert DEAF_AFTER_S <= 1.0
    assert asyncio.run(within(story())) >= 2


def test_a_peer_that_accepts_and_hangs_up_is_not_hammered():
    async def story() -> int:
        n = 0

        def hang_up(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
            nonlocal n
            n += 1
            writer.close()

        server = await asyncio.start_server(hang_up, "127.0.0.1", 0)
        async with Watched(f"tcp://127.0.0.1:{server.sockets[0].getsockname()[1]}") as watched:
            started = asyncio.get_running_loop().time()
            while asyncio.get_running_loop().time() - started < 0.6:
                await watched.until(Input.LOST)
        server.close()
        return n

    assert asyncio.run(story()) < 20  # 0.05, 0.1, 0.2, ... between attempts


def test_nothing_can_be_written_over_a_link_that_reads():
    async def story() -> list[int]:
        write = Request(unit=1, function=16, address=0, count=1, words=(7,))
        async with TcpPeer(constant) as peer:
            async with Watched(f"tcp://127.0.0.1:{peer.port}") as reading:
                await reading.until(Input.OPENED)
                with pytest.raises(PermissionError):
                    await reading.link.exchange(write)
                await reading.link.exchange(READ)
            async with Watched(f"tcp://127.0.0.1:{peer.port}", allow_write=True) as writing:
                await writing.until(Input.OPENED)
                assert (await writing.link.exchange(write)).words == (7,)
            return [request.function for request in peer.requests]

    assert asyncio.run(story()) == [3, 3, 16]  # the read, the proof of its reply, the write


# TCP


class Memory(asyncio.Transport):
    """A transport without a network: what is written is kept, and a read of one item, a proof, is answered next."""

    def __init__(self, wire: TcpWire) -> None:
        super().__init__()
        self.sent: list[bytes] = []
        self.gone = False
        self._wire = wire

    def write(self, data: bytes) -> None:
        self.sent.append(data)
        if data[10:12] == b"\0\1":
            proof = reply(int.from_bytes(data[:2], "big"), "0000", "0302")
            asyncio.get_running_loop().call_soon(self._wire.data_received, proof)

    def abort(self) -> None:
        self.gone = True


def wire(
    lost: list[object], tally: Counter[str] | None = None, ids: range = range(1, 60_000)
) -> tuple[TcpWire, Memory]:
    """A TCP wire on a transport of memory, with the transaction ids 1, 2, 3, ..."""
    one = TcpWire(30.0, iter(ids), Counter() if tally is None else tally, lost.append)
    memory = Memory(one)
    one.connection_made(memory)
    return one, memory


def reply(transaction: int, words: str = "00080009", pdu: str = "0304") -> bytes:
    data = bytes.fromhex(pdu + words)
    return transaction.to_bytes(2, "big") + b"\0\0" + (1 + len(data)).to_bytes(2, "big") + b"\1" + data


@pytest.mark.parametrize(
    ("chunks", "fault"),
    [
        ([reply(1)], None),
        ([reply(0), reply(20), reply(9), reply(1)], None),  # 0 and foreign ids are dropped
        ([reply(1)[:5], reply(1)[5:]], None),  # in pieces
        ([bytes([byte]) for byte in reply(1)], None),
        ([reply(7) + reply(1)], None),  # a late one and ours in one chunk
        ([reply(1) + b"\0"], ReplyFault.FRAMING),  # bytes behind it: who knows whose end it has
        ([reply(1) + reply(7)], None),
        ([b"\0\1\0\1\0\6" + bytes(6)], ReplyFault.FRAMING),
        ([reply(1, "0008")], ReplyFault.LENGTH),
        ([reply(1, pdu="0404")], ReplyFault.FUNCTION),
    ],
)
def test_what_a_stream_must_be_to_be_believed(chunks, fault):
    async def story() -> tuple[ReplyFault | None, tuple[int, ...], bool]:
        lost: list[object] = []
        one, memory = wire(lost)
        asked = asyncio.create_task(one.exchange(READ))
        await asyncio.sleep(0)
        for chunk in chunks:
            one.data_received(chunk)
        verdict = await within(asked)
        assert memory.gone == bool(lost)
        return verdict.fault, verdict.words, memory.gone

    verdict = asyncio.run(story())
    assert verdict[:2] == (fault, () if fault else (8, 9))
    assert verdict[2] == (fault is ReplyFault.FRAMING)


def test_half_a_reply_filled_up_by_an_earlier_one_is_not_believed():
    """A device that stops in the middle of a reply and then repeats an earlier one, which fits exactly."""

    async def story() -> ReplyFault | None:
        one, _ = wire([])
        first = asyncio.create_task(one.exchange(READ))
        await asyncio.sleep(0)
        one.data_received(reply(1))
        assert (await first).words == (8, 9)
        asked = asyncio.create_task(one.exchange(Request(unit=1, function=3, address=0, count=10)))
        await asyncio.sleep(0)
        right = reply(3, "0102" * 10, "0314")  # 2 is the proof of the first
        one.data_received(right[: len(right) - len(reply(1))] + reply(1))
        return (await within(asked)).fault

    assert asyncio.run(story()) is ReplyFault.FRAMING


def test_late_and_repeated_replies_are_counted():
    async def story() -> Counter[str]:
        tally: Counter[str] = Counter()
        one, _ = wire([], tally)
        asked = asyncio.create_task(one.exchange(READ))
        await asyncio.sleep(0)
        one.data_received(reply(5) + reply(1) + reply(1))
        await asked
        one.data_received(reply(1))
        return tally

    assert asyncio.run(story())["dropped frame: late, repeated or unasked"] == 3


def test_fuzzed_frames_leave_every_request_with_a_verdict():
    """Through the wire itself: every chunk of noise is taken, and a lost connection says so."""

    async def story() -> Counter[ReplyFault | None]:
        random, verdicts, lost = Random(8), Counter[ReplyFault | None](), list[object]()
        problems: list[dict[str, object]] = []
        asyncio.get_running_loop().set_exception_handler(lambda loop, context: problems.append(context))
        one, memory = wire(lost, ids=range(1, 200_000))
        for transaction in range(1, 20_001):
            if memory.gone:
                one, memory = wire(lost, ids=range(transaction, 60_000))
            asked = asyncio.create_task(one.exchange(READ))
            await asyncio.sleep(0)
            frame = bytearray(reply(int.from_bytes(memory.sent[-1][:2], "big")))
            for _ in range(random.randrange(3)):
                frame[random.randrange(len(frame))] = random.randrange(256)
            noise = random.randbytes(random.choice((0, 0, 0, 1, 9)))
            one.data_received(noise + bytes(frame[: random.choice((13, 13, 9, 4))]))
            for _ in range(6):  # the proof
                await asyncio.sleep(0)
            if not asked.done() and not memory.gone:
                one.connection_lost(None)
                memory.gone = True
            verdicts[(await within(asked)).fault] += 1
        assert not problems
        return verdicts

    verdicts = asyncio.run(story())
    assert verdicts.total() == 20_000
    assert set(verdicts) >= {
        None,
        ReplyFault.FRAMING,
        ReplyFault.LOST,
        ReplyFault.UNIT,
        ReplyFault.FUNCTION,
        ReplyFault.LENGTH,
    }
