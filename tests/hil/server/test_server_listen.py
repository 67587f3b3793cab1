"""Where a server listens: addresses, their mistakes, what is in use, what is exposed, lines that come and go."""

from __future__ import annotations

import asyncio
import contextlib
import os
import socket
import tty

import pytest
import serial
from pymodbus.client import AsyncModbusSerialClient
from served_ramp import Ramp, connected, device_of, port_of, settings

from hil import PtyAddress, SerialLine, Server, listen_address
from recordings import BadInput


def refusal(*listen, **more):
    """What a server says that cannot start."""

    async def main():
        async with Server({1: Ramp()}, settings(*listen, **more)):
            pass

    with pytest.raises(BadInput) as refused:
        asyncio.run(main())
    assert "\n" not in str(refused.value)
    return str(refused.value)


@pytest.mark.parametrize(
    "text",
    [
        "", "tcp:", "tcp://", "tcp://127.0.0.1", "tcp://127.0.0.1:x", "tcp://127.0.0.1:70000", "tcp://:5020",
        "tcp://127.0.0.1:1/x", "tcp://user@127.0.0.1:1", "tcp://no.such.host.invalid:1", "http://127.0.0.1:1", "rtu:",
        "rtu:/dev/x?baud=fast", "rtu:/dev/x?baud=1", "rtu:/dev/x?parity=Q", "rtu:/dev/x?stop=3", "rtu:/dev/x?bits=7",
        "tcp://[::1:1", "pty:/tmp/v?baud=9600", "pty", "pty:?x",
    ],
)  # fmt: skip
def test_an_address_that_is_none_lists_the_forms_there_are(text):
    with pytest.raises(BadInput, match=r"^listen.*: .*use one of: tcp://127\.0\.0\.1:5020"):
        listen_address(text)


def test_addresses_mean_what_they_say():
    assert listen_address("rtu:/dev/ttyS0") == SerialLine("/dev/ttyS0", 19200, "E", 1)
    assert listen_address("rtu:///dev/ttyS0?baud=9600&parity=n&stop=2") == SerialLine("/dev/ttyS0", 9600, "N", 2)
    assert listen_address("pty:/tmp/valve") == PtyAddress("/tmp/valve")
    assert listen_address("pty:") == PtyAddress("")
    assert listen_address("tcp://[::1]:5020").at(1) == "tcp://[::1]:1"
    assert [listen_address(f"tls://{host}:1").loopback for host in ("localhost", "127.9.9.9", "0.0.0.0")] == [
        True, True, False,
    ]  # fmt: skip


def test_a_pseudo_terminal_has_no_options():
    with pytest.raises(BadInput, match="the option 'baud' is not known \\(this kind of address has no options\\)"):
        listen_address("pty:/tmp/v?baud=9600")


def test_a_port_in_use_is_refused():
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        port = other.getsockname()[1]
        assert f"tcp://127.0.0.1:{port}: the port is in use" in refusal(f"tcp://127.0.0.1:{port}")


def test_a_failure_of_the_second_address_closes_the_first():
    async def main():
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            port = free.getsockname()[1]
        with pytest.raises(BadInput):
            async with Server({1: Ramp()}, settings(f"tcp://127.0.0.1:{port}", "rtu:/dev/no-such-line")):
                pass
        async with Server({1: Ramp()}, settings(f"tcp://127.0.0.1:{port}")) as server, connected(server) as client:
            assert not (await client.read_input_registers(0, count=2, device_id=1)).isError()

    asyncio.run(main())


def test_an_address_that_is_not_ours_is_refused():
    assert "no such address" in refusal("tcp://192.0.2.1:0", expose=True)


def test_listening_beyond_this_machine_needs_to_be_meant_and_says_what_it_means():
    assert "expose it if it is meant" in refusal("tcp://0.0.0.0:0")
    assert "expose it if it is meant" in refusal("tcp://[::]:0")
    meant = settings("tcp://0.0.0.0:0", "tls://0.0.0.0:0", "tcp://127.0.0.1:0", expose=True, harm=True)
    plain, secure = meant.exposure()
    assert "without a password or encryption, read every value and write set points and switch on faults" in plain
    assert "with a certificate of your authority" in secure
    assert "write" not in settings("tcp://0.0.0.0:0", expose=True, write_map=None).exposure()[0]


@pytest.mark.parametrize(
    ("device", "words"),
    [("/dev/no-such-line", "there is no serial device"), ("/dev/null", "not a usable serial device")],
)
def test_a_line_that_cannot_be_opened_is_refused(device, words):
    assert words in refusal(f"rtu:{device}")


def test_a_busy_line_is_refused():
    near, far = os.openpty()
    try:
        with serial.Serial(os.ttyname(far), exclusive=True):
            assert "busy" in refusal(f"rtu:{os.ttyname(far)}")
    finally:
        os.close(near)
        os.close(far)


def test_a_served_line_answers_every_client_that_comes_and_goes(tmp_path):
    async def main():
        name = tmp_path / "valve"
        async with Server({1: Ramp()}, settings(f"pty:{name}", speed=None)) as server:
            assert server.addresses == [f"rtu:{name}?parity=N"]
            for _ in range(3):
                async with connected(server) as client:
                    assert (await client.read_input_registers(22, count=1, device_id=1)).registers == [3]
        assert not name.is_symlink()

    asyncio.run(main())


def test_a_name_that_is_taken_is_not_given_to_a_line(tmp_path):
    (tmp_path / "valve").write_text("mine")
    assert "use a name that is free" in refusal(f"pty:{tmp_path / 'valve'}")
    assert (tmp_path / "valve").read_text() == "mine"


def test_a_serial_device_is_served_on_a_real_line():
    """The far end of a pseudo terminal stands for the device: what comes out of its near end is the reply."""

    async def main():
        near, far = os.openpty()
        reply, loop = asyncio.get_running_loop().create_future(), asyncio.get_running_loop()
        got = bytearray()

        def read():
            got.extend(os.read(near, 100))
            if len(got) >= 7 and not reply.done():
                reply.set_result(bytes(got))

        try:
            async with Server({1: Ramp()}, settings(f"rtu:{os.ttyname(far)}", speed=None)):
                loop.add_reader(near, read)
                os.write(near, bytes.fromhex("010400160001d00e"))
                assert await asyncio.wait_for(reply, 5) == bytes.fromhex("0104020003f931")
        finally:
            loop.remove_reader(near)
            os.close(near)
            os.close(far)

    asyncio.run(main())


def test_stopping_frees_the_port_and_the_line():
    async def main():
        async with Server({1: Ramp()}, settings("tcp://127.0.0.1:0", "pty:")) as server:
            port, device = port_of(server.addresses[0]), device_of(server.addresses[1])
            client = AsyncModbusSerialClient(device, timeout=1, retries=0)
            assert await client.connect()
            client.close()
        assert not os.path.exists(device)
        async with Server({1: Ramp()}, settings(f"tcp://127.0.0.1:{port}")) as again:
            assert port_of(again.addresses[0]) == port

    asyncio.run(main())


def test_a_line_that_goes_away_is_served_again_when_it_is_back(tmp_path, caplog):
    async def main():
        name, pairs = tmp_path / "line", [os.openpty(), os.openpty()]
        name.symlink_to(os.ttyname(pairs[0][1]))
        async with Server({1: Ramp()}, settings(f"rtu:{name}", speed=None)):
            assert await exchanged(pairs[0][0])
            for end in pairs.pop(0):
                os.close(end)
            name.unlink()
            name.symlink_to(os.ttyname(pairs[0][1]))
            async with asyncio.timeout(10):
                while not await exchanged(pairs[0][0]):
                    pass
        for end in pairs[0]:
            os.close(end)

    async def exchanged(near):
        """Whether a request on a line is answered within half a second."""
        tty.setraw(near)
        os.set_blocking(near, False)
        os.write(near, bytes.fromhex("010400160001d00e"))
        for _ in range(50):
            await asyncio.sleep(0.01)
            with contextlib.suppress(BlockingIOError):
                return os.read(near, 100) == bytes.fromhex("0104020003f931")
        return False

    asyncio.run(main())
    assert "is lost" in caplog.text
