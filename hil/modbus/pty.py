"""Serial lines without serial hardware: pseudo terminals joined by the event loop."""

from __future__ import annotations

import asyncio
import os
from collections.abc import Callable
from contextlib import suppress
from types import TracebackType
from typing import Self

Receive = Callable[[bytes], None]
MOST_UNREAD = 1 << 16


class PtyEnd:
    """A pseudo terminal whose far end, `path`, is opened by somebody as a serial port; bytes come and go here.

    Baud rate and parity are not simulated. The far end is also kept open here, so that the line outlives whoever
    opens and closes it. Use inside a running event loop, as a context manager or with `close`.
    """

    def __init__(self, receive: Receive | None = None) -> None:
        import tty  # pseudo terminals are there on Unix only

        self._near, self._far = os.openpty()
        tty.setraw(self._near)
        tty.setraw(self._far)
        os.set_blocking(self._near, False)
        self.path = os.ttyname(self._far)
        self.receive = receive
        self._unsent = bytearray()
        self._loop = asyncio.get_running_loop()
        self._loop.add_reader(self._near, self._read)
        self._open = True

    def write(self, data: bytes) -> None:
        """Send towards the far end. What nobody reads for long is lost, as on a line that nobody listens to."""
        if not self._open:
            return
        if len(self._unsent) + len(data) > MOST_UNREAD:
            self._unsent.clear()
        self._unsent += data
        self._flush()

    def close(self) -> None:
        """Take the line away; a second call does nothing."""
        if self._open:
            self._open = False
            self._loop.remove_reader(self._near)
            self._loop.remove_writer(self._near)
            os.close(self._near)
            os.close(self._far)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self.close()

    def _read(self) -> None:
        with suppress(BlockingIOError):
            data = os.read(self._near, 4096)
            if data and self.receive is not None:
                self.receive(data)

    def _flush(self) -> None:
        with suppress(BlockingIOError):
            while self._unsent:
                del self._unsent[: os.write(self._near, self._unsent)]
        if self._unsent:
            self._loop.add_writer(self._near, self._flush)
        else:
            self._loop.remove_writer(self._near)


class PtyLine:
    """Two pseudo terminals joined into a line: a server opens `server_path`, a client `client_path`."""

    def __init__(self) -> None:
        self._server, self._client = PtyEnd(), PtyEnd()
        self._server.receive, self._client.receive = self._client.write, self._server.write
        self.server_path, self.client_path = self._server.path, self._client.path

    def close(self) -> None:
        """Take the line away."""
        self._server.close()
        self._client.close()
