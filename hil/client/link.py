"""The link to a peer: kept open for as long as it runs, whatever happens at the other end.

`Link.run` opens the connection, again and again while the peer is absent, and opens it anew at once when it is lost or
has been deaf for too long: a connection over a cut cable looks open for many minutes, and its repeats come ever later,
while a new one is there as soon as the peer is.
"""

from __future__ import annotations

import asyncio
import ssl
from collections import Counter
from collections.abc import Callable

from hil.client.state import REOPEN, Input
from hil.client.transport import LinkSide, LiveAddress
from hil.client.wire import GONE, Wire
from hil.modbus.checks import transactions
from hil.modbus.messages import Reply, ReplyFault, Request
from hil.modbus.terminals import TerminalError

OnConnection = Callable[[Input, str], None]
"""Told when the connection opens or is lost (`Input.OPENED`, `Input.LOST`), at once, with the reason in words."""

OPEN_WITHIN_S = 1.0
DEAF_AFTER_S = 1.0


class Link:
    """A connection that is kept open, and requests over it, one at a time.

    address : of the peer; on_connection : see `OnConnection`; allow_write : whether a request may change something in
    the device. Raises BadInput for what no waiting heals, as `LiveAddress.opening` does.
    """

    def __init__(self, address: LiveAddress, on_connection: OnConnection, *, allow_write: bool = False) -> None:
        self.address = address
        self.tally: Counter[str] = Counter()
        self._on_connection, self.allow_write = on_connection, allow_write
        self._opening = address.opening()
        self._side = LinkSide(transactions(), self.tally, self._give_up)
        # The ids go on over all connections: some gateways mix them up.
        self._wire: Wire | None = None
        self._lost: asyncio.Future[Exception | None] | None = None
        self._turn = asyncio.Lock()
        self._deaf_since: float | None = None
        self._heard = self._ever_heard = False  # a usable reply: over this connection, over any

    @property
    def open(self) -> bool:
        """Whether there is a connection; whether anybody answers on it is another matter."""
        return self._wire is not None

    async def run(self) -> None:
        """Keep the connection open until cancelled. Raises BadInput when the peer refuses us at first."""
        failures = 0
        try:
            while True:
                try:
                    async with asyncio.timeout(max(OPEN_WITHIN_S, self.address.timeout)):
                        await self._open()  # `wait_for` of Python 3.11 would lose a cancellation just then
                    await self._until_lost()
                except (OSError, TerminalError) as error:  # also ssl.SSLError, SerialException, TimeoutError
                    self._refuse(error)
                    self._on_connection(Input.LOST, f"{self.address.text}: {_words(error)}")
                failures = 0 if self._heard else failures + 1
                await asyncio.sleep(REOPEN.delay(failures) if failures else 0.0)
        finally:
            self._close()

    def listens(self, unit: int) -> bool:
        """Whether a unit cannot be asked for a while, because its reply to an earlier request may still come."""
        return self._wire is not None and self._wire.listens(unit)

    async def exchange(self, request: Request) -> Reply:
        """Send a request and return the verdict on its reply; `ReplyFault.LOST` at once when there is no connection.

        Raises PermissionError when the request would write and the link was not made for that.
        """
        if request.writes and not self.allow_write:
            raise PermissionError("this link only reads: nothing may be written over it")
        async with self._turn:
            if self._wire is None:
                return GONE
            asked_at = asyncio.get_running_loop().time()
            reply = await self._wire.exchange(request)
        self._note(reply, asked_at)
        return reply

    def _note(self, reply: Reply, asked_at: float) -> None:
        if reply.fault is not None:
            self.tally[reply.fault] += 1
        if reply.fault in (None, ReplyFault.EXCEPTION):
            self._deaf_since, self._heard, self._ever_heard = None, True, True
            return
        self._deaf_since = asked_at if self._deaf_since is None else self._deaf_since
        deaf = asyncio.get_running_loop().time() - self._deaf_since
        if deaf > max(DEAF_AFTER_S, 3 * self.address.timeout) and self.address.reopened:
            self._give_up(ConnectionError(f"no usable reply for {deaf:.1f} s, the last time: {reply.text}"))

    def _give_up(self, error: Exception | None) -> None:
        """The connection is gone, or as good as gone."""
        self._close()
        if self._lost is not None and not self._lost.done():
            self._lost.set_result(error)
            self._on_connection(Input.LOST, f"{self.address.text}: {_words(error)}")

    async def _until_lost(self) -> None:
        assert self._lost is not None
        error = await self._lost
        if not self._ever_heard:
            self._refuse(error)

    async def _open(self) -> None:
        self._lost, self._heard, self._deaf_since = asyncio.get_running_loop().create_future(), False, None
        wire = await self._opening(self._side)
        if not self._lost.done():
            self._wire = wire
            self._on_connection(Input.OPENED, f"{self.address.text}: connected")

    def _close(self) -> None:
        wire, self._wire = self._wire, None
        if wire is not None:
            wire.close()

    def _refuse(self, error: BaseException | None) -> None:
        refusal = None if self._ever_heard else self.address.refusal(error)
        if refusal is not None:
            raise refusal from None


def _words(error: BaseException | None) -> str:
    match error:
        case None:
            return "closed by the peer"
        case TimeoutError():
            return "no answer to the attempt to connect"
        case ConnectionRefusedError():
            return "connection refused"
        case ssl.SSLError():
            return f"TLS failed ({error.reason or error})"
        case _:
            return str(error) or type(error).__name__
