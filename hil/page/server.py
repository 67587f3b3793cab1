"""The server of the page: bokeh's, behind a gate, with everything that a browser needs from here and nowhere else."""

from __future__ import annotations

import contextlib
import secrets
import socket
from collections.abc import Callable, Iterator, Mapping
from typing import Any

from bokeh.document import Document
from bokeh.resources import Resources
from bokeh.server.server import BaseServer
from bokeh.server.tornado import BokehTornado
from bokeh.server.views.static_handler import StaticHandler
from tornado.httpserver import HTTPServer
from tornado.httputil import HTTPHeaders
from tornado.ioloop import IOLoop
from tornado.web import GZipContentEncoding, OutputTransform, RequestHandler

from hil.page.access import Access
from hil.page.gate import SIGN_IN, Gate, GatedRouter
from hil.page.sign_in import SignIn

MakeDocument = Callable[[Document], None]

HEADERS = {
    "Content-Security-Policy": "default-src 'none'; script-src 'self' 'unsafe-inline'; style-src 'unsafe-inline'; "
    "img-src 'self' data: blob:; connect-src 'self'; base-uri 'none'; form-action 'self'; frame-ancestors 'none'",
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Server": "bristle",
}
"""Of every answer. The browser itself refuses what would come from elsewhere, even if a text of ours asked for it."""

LARGEST_BODY, LARGEST_HEADER, LARGEST_MESSAGE = 16_384, 16_384, 65_536
"""Of what a browser sends [bytes]: a token, a choice, the size of a drawing."""

IDLE_S, UNUSED_MS = 60.0, 5_000
"""When a connection that says nothing is closed [s], and a page that nobody has open any more is forgotten [ms]."""


class _Headers(OutputTransform):
    def transform_first_chunk(
        self, status_code: int, headers: HTTPHeaders, chunk: bytes, finishing: bool
    ) -> tuple[int, HTTPHeaders, bytes]:
        for name, value in HEADERS.items():
            headers[name] = value
        if "Cache-Control" not in headers and "Expires" not in headers:
            headers["Cache-Control"] = "no-store"
        return status_code, headers, chunk


class _Alive(RequestHandler):
    """What a page asks that lost its server, until it is there again."""

    def get(self) -> None:
        self.set_status(204)


class _Application(BokehTornado):  # type: ignore[misc]  # bokeh has no types
    """Bokeh's application, with its script from this server whatever the environment says."""

    def resources(self, absolute_url: str | bool | None = None) -> Resources:
        return Resources(mode="server", root_url="/", components=["bokeh"], path_versioner=StaticHandler.append_version)


@contextlib.contextmanager
def page_server(
    access: Access, listening: socket.socket, documents: Mapping[str, MakeDocument]
) -> Iterator[BaseServer]:
    """Serve documents by their paths while the context lasts, in the event loop that runs.

    listening : bound already, so that the address outlives this process. Raises BadInput for certificates.
    """
    port = listening.getsockname()[1]
    transforms: list[type[OutputTransform]] = [GZipContentEncoding, _Headers]
    application = _Application(
        dict(documents),
        extra_patterns=[(r"/alive", _Alive), *_sign_in(access)],
        extra_websocket_origins=["*"],  # the gate has looked at the origin
        secret_key=secrets.token_bytes(32),
        sign_sessions=True,
        use_index=False,
        ico_path="none",
        include_headers=[],
        include_cookies=[],
        unused_session_lifetime_milliseconds=UNUSED_MS,
        check_unused_sessions_milliseconds=UNUSED_MS,
        websocket_max_message_size_bytes=LARGEST_MESSAGE,
        transforms=transforms,
    )
    http = HTTPServer(
        GatedRouter(Gate(access, port), application, [_Headers]), ssl_options=access.tls(),
        max_body_size=LARGEST_BODY, max_header_size=LARGEST_HEADER, idle_connection_timeout=IDLE_S,
    )  # fmt: skip
    listening.setblocking(False)
    http.add_sockets([listening])
    server = BaseServer(IOLoop.current(), application, http)
    server.start()
    try:
        yield server
    finally:
        server.stop(wait=False)


def _sign_in(access: Access) -> list[Any]:
    return [] if access.token is None else [(SIGN_IN, SignIn, {"access": access})]
