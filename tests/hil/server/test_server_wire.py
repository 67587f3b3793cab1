"""The server's side of the wire: requests however they arrive, and what is said to nobody or is no Modbus."""

from __future__ import annotations

import asyncio

import pytest
import serial
from served_ramp import Clock, Ramp, connected, device_of, port_of, settings

from hil import Server
from hil.server import handler
from hil.testing import crc


async def raw(server, *pieces, wanted):
    """What comes back on one TCP connection for bytes sent in pieces, up to `wanted` bytes or the end."""
    reader, writer = await asyncio.open_connection("127.0.0.1", port_of(server.addresses[0]))
    try:
        for piece in pieces:
            writer.write(piece)
            await writer.drain()
            await asyncio.sleep(0.01)
        async with asyncio.timeout(5):
            return await reader.readexactly(wanted)
    except asyncio.IncompleteReadError as ended:
        return ended.partial
    finally:
        writer.close()


ASK = [bytes.fromhex(f"{k:04x} 0000 0006 01 04 {20 + k:04x} 0001") for k in range(3)]
ANSWER = [bytes.fromhex(f"{k:04x} 0000 0005 01 04 02") + bytes([0, word]) for k, word in enumerate((0, 0, 3))]


@pytest.mark.parametrize(
    "pieces",
    [[b"".join(ASK)], [ASK[0] + ASK[1][:5], ASK[1][5:] + ASK[2]], [bytes([byte]) for byte in b"".join(ASK)]],
    ids=["at once", "cut", "byte by byte"],
)
def test_requests_are_answered_in_turn_however_they_arrive(pieces):
    async def main():
        async with Server({1: Ramp()}, settings(speed=None)) as server:
            assert await raw(server, *pieces, wanted=33) == b"".join(ANSWER)

    asyncio.run(main())


@pytest.mark.parametrize(
    "noise", [b"GET / HTTP/1.1\r\n\r\n", ASK[0][:4] + b"\0\0" + ASK[0][6:], ASK[0][:4] + b"\xff\xff" + ASK[0][6:]]
)
def test_a_connection_that_does_not_speak_modbus_is_closed(noise):
    async def main():
        async with Server({1: Ramp()}, settings(speed=None)) as server:
            assert await raw(server, ASK[0], noise, ASK[1], wanted=22) == ANSWER[0]
            assert await raw(server, ASK[2], wanted=11) == ANSWER[2]

    asyncio.run(main())


@pytest.mark.parametrize("code", [0, 7, 8, 17, 20, 24, 43, 0x83, 0xFF])
def test_functions_beyond_reading_and_writing_registers_are_refused(code):
    async def main():
        request = bytes.fromhex("0001 0000 0006 01") + bytes([code]) + bytes.fromhex("00000001")
        async with Server({1: Ramp()}, settings(speed=None)) as server:
            answer = await raw(server, request, wanted=9)
            assert (answer[7], answer[8]) == (code | 0x80, 1)

    asyncio.run(main())


async def heard(line: serial.Serial, n_bytes: int) -> bytes:
    """What a line says, so many bytes at least."""
    async with asyncio.timeout(5):
        while line.in_waiting < n_bytes:
            await asyncio.sleep(0.005)
    return line.read(100)


def test_a_line_forgets_half_a_request_after_a_silence():
    async def main():
        clock = Clock()
        async with Server({1: Ramp()}, settings("pty:", speed=None), clock) as server:
            line = serial.Serial(device_of(server.addresses[0]), timeout=0)
            try:
                line.write(bytes.fromhex("0104001600"))
                await asyncio.sleep(0.05)
                clock.now += 1.0
                line.write(bytes.fromhex("010400160001d00e"))
                assert await heard(line, 7) == bytes.fromhex("0104020003f931")
            finally:
                line.close()

    asyncio.run(main())


def test_a_line_of_several_devices_hears_only_the_one_that_is_asked():
    async def main():
        async with Server({1: Ramp()}, settings("pty:", speed=None), Clock()) as server:
            line = serial.Serial(device_of(server.addresses[0]), timeout=0)
            try:
                for body in ("0504001600 01", "052b0e0100", "0507"):
                    line.write(bytes.fromhex(body) + crc(bytes.fromhex(body)))
                    await asyncio.sleep(0.02)
                line.write(bytes.fromhex("010400160001d00e"))
                assert await heard(line, 7) == bytes.fromhex("0104020003f931")
            finally:
                line.close()

    asyncio.run(main())


def test_idle_connections_never_shut_a_polling_client_out(monkeypatch):
    """Thirty clients that say nothing, where eight have room: the one that polls stays, and a new one gets in."""
    monkeypatch.setattr(handler, "MOST_CONNECTIONS", 8)

    async def story():
        async with Server({1: Ramp()}, settings()) as server, connected(server) as polling:
            port = port_of(server.addresses[0])
            idle = []
            for _ in range(30):
                idle.append(await asyncio.open_connection("127.0.0.1", port))
                assert not (await polling.read_input_registers(0, count=1, device_id=1)).isError()
            async with connected(server) as late:
                assert not (await late.read_input_registers(0, count=1, device_id=1)).isError()
            ends = [await asyncio.wait_for(reader.read(1), 5) for reader, _ in idle[:20]]
            for _, writer in idle:
                writer.close()
            return ends

    assert asyncio.run(story()) == [b""] * 20


def test_a_connection_that_asks_nothing_is_closed(monkeypatch):
    monkeypatch.setattr(handler, "IDLE_S", 0.05)

    async def story():
        async with Server({1: Ramp()}, settings()) as server:
            reader, writer = await asyncio.open_connection("127.0.0.1", port_of(server.addresses[0]))
            end = await asyncio.wait_for(reader.read(1), 5)
            writer.close()
            return end

    assert asyncio.run(story()) == b""
