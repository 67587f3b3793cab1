"""A fault injector between a client and any server: on TCP, and on a serial line made of pseudo terminals."""

from __future__ import annotations

import asyncio
import os
from collections.abc import Callable
from contextlib import suppress
from types import TracebackType
from typing import Self

from hil.modbus.pty import PtyEnd
from hil.testing.fault_injector import FaultInjector, FaultSchedule
from hil.testing.fault_modes import Close, Send
from hil.testing.frame_cutter import FrameCutter

Write = Callable[[bytes], None]


class TcpFaultInjector:
    """Listens on loopback, `port`, and passes everything on to a server; replies suffer what the schedule says.

    Requests pass unharmed. Faults count over all connections, `injector.counts`. Asynchronous context manager.
    listen_port : where to listen, 0 for any free port.
    """

    def __init__(self, host: str, port: int, schedule: FaultSchedule, listen_port: int = 0) -> None:
        self._upstream = (host, port)
        self.injector = FaultInjector(schedule, "tcp")
        self.port = listen_port
        self._cut = False
        self._server: asyncio.Server | None = None
        self._connections: set[asyncio.Task[None]] = set()

    async def __aenter__(self) -> Self:
        self._server = await asyncio.start_server(self._accept, "127.0.0.1", self.port)
        self.port = self._server.sockets[0].getsockname()[1]
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None
    ) -> None:
        if self._server is not None:
            self._server.close()
        for connection in self._connections:
            connection.cancel()
        await asyncio.gather(*self._connections, return_exceptions=True)

    def cut(self) -> None:
        """End every connection, and let none pass until `mend`: new ones are closed at once, no request arrives."""
        self._cut = True
        for connection in self._connections:
            connection.cancel()

    def mend(self) -> None:
        """Let connections pass again."""
        self._cut = False

    def _accept(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        if self._cut:
            writer.close()
            return
        task = asyncio.ensure_future(self._serve(reader, writer))
        self._connections.add(task)
        task.add_done_callback(self._connections.discard)

    async def _serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        """One client's connection, until either side or a fault ends it."""
        server: asyncio.StreamWriter | None = None
        try:
            answers, server = await asyncio.open_connection(*self._upstream)
            directions = {
                asyncio.ensure_future(_copy(reader, server)),
                asyncio.ensure_future(self._harm(answers, writer)),
            }
            try:
                await asyncio.wait(directions, return_when=asyncio.FIRST_COMPLETED)
            finally:
                for direction in directions:
                    direction.cancel()
                await asyncio.gather(*directions, return_exceptions=True)
        except OSError:
            pass  # the server is away: the client sees its connection close, as it would without us
        finally:
            for end in (writer, server):
                if end is not None:
                    end.close()

    async def _harm(self, answers: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        cutter = FrameCutter("tcp")
        while data := await answers.read(4096):
            for frame in cutter.feed(data):
                if not await _perform(self.injector, frame, writer.write):
                    return


class RtuFaultInjector:
    """Opens a server's serial line, `device`, and offers a pseudo terminal, `path`, on which replies suffer.

    Asynchronous context manager. What is due to be sent is sent in order: a slow reply holds up the next one.
    """

    def __init__(self, device: str, schedule: FaultSchedule) -> None:
        self._device = device
        self.injector = FaultInjector(schedule, "rtu")
        self.path = ""
        self._cut = False
        self._replies: asyncio.Queue[bytes] = asyncio.Queue()
        self._cutter = FrameCutter("rtu")

    async def __aenter__(self) -> Self:
        self._line = os.open(self._device, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
        import tty  # pseudo terminals are there on Unix only

        tty.setraw(self._line)
        self._client = PtyEnd(self._request)
        self.path = self._client.path
        asyncio.get_running_loop().add_reader(self._line, self._read)
        self._worker = asyncio.create_task(self._harm())
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None
    ) -> None:
        self._worker.cancel()
        await asyncio.gather(self._worker, return_exceptions=True)
        asyncio.get_running_loop().remove_reader(self._line)
        self._client.close()
        os.close(self._line)

    def cut(self) -> None:
        """Let nothing pass until `mend`, in either direction."""
        self._cut = True

    def mend(self) -> None:
        """Let bytes pass again."""
        self._cut = False

    def _request(self, data: bytes) -> None:
        if self._cut:
            return
        with suppress(BlockingIOError):
            os.write(self._line, data)

    def _read(self) -> None:
        with suppress(BlockingIOError):
            for frame in self._cutter.feed(os.read(self._line, 4096)):
                self._replies.put_nowait(frame)

    async def _harm(self) -> None:
        while True:
            frame = await self._replies.get()
            if not self._cut:
                await _perform(self.injector, frame, self._client.write)


async def _copy(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
    while data := await reader.read(4096):
        writer.write(data)
        await writer.drain()


async def _perform(injector: FaultInjector, frame: bytes, write: Write) -> bool:
    """Send what becomes of a reply; False when the connection is to end."""
    for action in injector.reply(frame):
        if isinstance(action, Close):
            return False
        assert isinstance(action, Send)
        if action.after:
            await asyncio.sleep(action.after)
        write(action.data)
    return True
