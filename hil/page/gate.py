"""What every request passes before the page sees it, a websocket's handshake included.

A request must ask for a path that there is, by a name of this server, from one of its own pages, and know the token
where there is one. All else is refused here in one line, so that nothing behind has to be trusted with it.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any
from urllib.parse import urlsplit

from tornado.httputil import HTTPMessageDelegate, HTTPServerRequest
from tornado.routing import Router
from tornado.web import Application, OutputTransform, RequestHandler

from hil.page.access import COOKIE, Access

SIGN_IN = "/sign-in"
PATHS = re.compile(r"/|/ws|/valve|/valve/ws|/alive|/static/js/bokeh\.min\.js")
"""What there is to ask for; the server of bokeh has more that nobody needs here."""

SITES = ("same-origin", "none")
"""Values of Sec-Fetch-Site that a page of ours, or a person who types the address, gives."""

HOST = re.compile(r"[A-Za-z0-9.-]{1,253}(:\d{1,5})?|\[[0-9A-Fa-f:]{2,45}\](:\d{1,5})?")


@dataclass(frozen=True)
class PageRefusal:
    """Why a request goes no further: a status of HTTP and words."""

    status: int
    words: str


class Gate:
    """Judges requests. access : who may look; port : that was bound."""

    def __init__(self, access: Access, port: int) -> None:
        self._access = access
        self._names = {f"{name}:{port}" for name in ("127.0.0.1", "localhost", "[::1]", access.host)}

    def refusal(self, request: HTTPServerRequest) -> PageRefusal | None:
        """Why not, if not."""
        host = request.headers.get_list("Host")
        if len(host) != 1 or not HOST.fullmatch(host[0]):
            return PageRefusal(400, "the request names no host")
        if self._access.token is None and host[0] not in self._names:  # a page elsewhere whose name leads here
            return PageRefusal(403, "this server has another name")
        if not self._is_own(request, host[0]):
            return PageRefusal(403, "requests from other sites are refused")
        if request.path == SIGN_IN and self._access.token is not None:
            return None if request.method in ("GET", "POST") else PageRefusal(405, "ask with GET or POST")
        if not PATHS.fullmatch(request.path):
            return PageRefusal(404, "there is nothing under this address")
        if request.method not in ("GET", "HEAD"):
            return PageRefusal(405, "nothing can be changed here")
        if not self._is_known(request):
            return PageRefusal(401, "sign in first")
        return None

    def _is_own(self, request: HTTPServerRequest, host: str) -> bool:
        """Whether it comes from a page of this server. Browsers say so for a websocket and whatever changes things."""
        origin = request.headers.get("Origin")
        if origin is not None:
            parts = urlsplit(origin)
            return parts.netloc.lower() == host.lower() and parts.scheme in ("http", "https")
        if request.path.endswith("/ws") or request.method == "POST":
            return False
        return request.headers.get("Sec-Fetch-Site", "none") in SITES or _opens_a_page(request.headers)

    def _is_known(self, request: HTTPServerRequest) -> bool:
        if self._access.token is None:
            return True
        scheme, _, token = request.headers.get("Authorization", "").partition(" ")
        if scheme.lower() == "bearer":
            return self._access.knows(token.strip())
        cookie = request.cookies.get(COOKIE)
        return self._access.admits(None if cookie is None else cookie.value)


class Refuser(RequestHandler):
    """Answers what was refused."""

    def initialize(self, refusal: PageRefusal) -> None:
        """refusal : why."""
        self._refusal = refusal

    async def prepare(self) -> None:
        """Answer, whatever was asked for, or lead a person to where the token can be given."""
        if self._refusal.status == 401 and self.request.path in ("/", "/valve"):
            self.redirect(SIGN_IN, status=303)
            return
        self.set_status(self._refusal.status)
        self.set_header("Content-Type", "text/plain; charset=utf-8")
        await self.finish(f"{self._refusal.words}\n")


def _opens_a_page(headers: Mapping[str, str]) -> bool:
    """Whether somebody follows a link from another site: that shows the page to him and to nobody else."""
    return headers.get("Sec-Fetch-Mode") == "navigate" and headers.get("Sec-Fetch-Dest") == "document"


class GatedRouter(Router):
    """Leads to an application what may pass, and answers the rest.

    transforms : of tornado, for what is refused; the application has its own.
    """

    def __init__(self, gate: Gate, behind: Application, transforms: list[type[OutputTransform]]) -> None:
        self._gate, self._behind = gate, behind
        self._refusals = Application([], transforms=transforms)

    def find_handler(self, request: HTTPServerRequest, **_: Any) -> HTTPMessageDelegate | None:
        """Who answers."""
        refusal = self._gate.refusal(request)
        if refusal is None:
            return self._behind.find_handler(request)
        return self._refusals.get_handler_delegate(request, Refuser, {"refusal": refusal})
