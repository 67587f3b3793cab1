"""The control port of a bench: what a test may do to simulated valves, for programs in any language.

One line of JSON is a request, one line the answer, on a TCP connection to loopback. The first request must be
``{"do": "hello", "token": "..."}`` with the token of the opening line: other users of the machine, and pages in a
browser, do not know it. An answer has ``"ok": true`` and what was asked for, or ``"ok": false`` and ``"error"``.
"""

from __future__ import annotations

import asyncio
import hmac
import json
import secrets
from collections.abc import Callable, Mapping
from types import TracebackType
from typing import Any, Self

from pydantic import ValidationError

from hil.plant.actuator import ActuatorPlant
from hil.running import Stop, first_of
from hil.server.server import ServerSettings
from hil.server.session import ServerEnd, closing_line, opening_line
from hil.testing.bench.bench import Bench
from hil.testing.bench.requests import End, Hello, of_line
from recordings import BadInput

LONGEST_LINE = 1 << 16
"""Bytes of a request; whoever sends more is dropped."""


class ControlPort:
    """Listens on 127.0.0.1 and does to a bench what it is asked for. Asynchronous context manager.

    Parameters
    ----------
    bench : Bench
        An open one.
    stop : callable
        Called when a client asks for the end.
    port : int, optional
        Where to listen; 0 takes a free one.

    Entering raises BadInput when the port cannot be used.
    """

    def __init__(self, bench: Bench, stop: Callable[[], None], port: int = 0) -> None:
        self._bench, self._stop, self._wanted = bench, stop, port
        self.token = secrets.token_urlsafe(24)
        self._connections: set[asyncio.Task[None]] = set()

    async def __aenter__(self) -> Self:
        try:
            self._server = await asyncio.start_server(self._accept, "127.0.0.1", self._wanted, limit=LONGEST_LINE)
        except OSError as error:
            remedy = "use another port (0 takes a free one)"
            raise BadInput(f"port {self._wanted}", f"cannot listen there ({error.strerror})", remedy) from None
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None
    ) -> None:
        self._server.close()
        await asyncio.sleep(0)  # the answer to `stop` is on its way
        for connection in self._connections:
            connection.cancel()
        await asyncio.gather(*self._connections, return_exceptions=True)

    @property
    def address(self) -> str:
        """Where clients find it: ``127.0.0.1:40321``."""
        return f"127.0.0.1:{self._server.sockets[0].getsockname()[1]}"

    def _accept(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        task = asyncio.ensure_future(self._converse(reader, writer))
        self._connections.add(task)
        task.add_done_callback(self._connections.discard)

    async def _converse(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        """Answer the requests of one client in turn; whoever does not begin with the token is dropped."""
        try:
            line = await reader.readline()
            if not self._knows_token(line):
                return
            writer.write(_line(await self._answer(line)))
            while line := await reader.readline():
                writer.write(_line(await self._answer(line)))
                await writer.drain()
        except (OSError, ValueError):
            pass  # the client is gone, or its line has no end
        finally:
            writer.close()

    def _knows_token(self, line: bytes) -> bool:
        try:
            request = of_line(line)
        except (ValidationError, ValueError):
            return False
        return isinstance(request, Hello) and hmac.compare_digest(request.token.encode(), self.token.encode())

    async def _answer(self, line: bytes) -> Mapping[str, Any]:
        try:
            request = of_line(line)
            if isinstance(request, End):
                self._stop()
                return {"ok": True}
            return {"ok": True, **await request.carry_out(self._bench)}
        except ValidationError as error:
            first = error.errors()[0]
            place = ".".join(str(part) for part in first["loc"])
            return {"ok": False, "error": f"{place or 'request'}: {first['msg']}"}
        except (BadInput, ValueError) as error:
            return {"ok": False, "error": str(error)}


def _line(content: Mapping[str, Any]) -> bytes:
    return json.dumps(content).encode() + b"\n"


async def bench_session(
    plants: Mapping[int, ActuatorPlant],
    settings: ServerSettings,
    duration: float | None,
    say: Callable[[str], None],
    control: int = 0,
) -> ServerEnd:
    """Serve like `serve_session`, with a control port; ends also when a client of the port says stop.

    The opening line has ``control`` (host and port) and ``token`` besides the rest. Raises BadInput.
    """
    async with Bench(plants, settings) as bench:
        with Stop(duration) as stop:
            async with ControlPort(bench, stop.event.set, control) as port:
                opening = opening_line(bench.server, settings) | {"listening": bench.addresses}
                say(json.dumps(opening | {"control": port.address, "token": port.token}))
                await first_of(stop.event.wait(), bench.server.failed())
        say(json.dumps(closing_line(bench.server, stop.first_signal)))
    return ServerEnd(stop.first_signal)
