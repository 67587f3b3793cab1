"""Who may look at the page: the rules of its gate on a real server, over sockets, and the settings that are refused."""

from __future__ import annotations

import json
import socket
import ssl
from collections.abc import Callable, Iterator
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from email.message import Message
from email.parser import Parser
from pathlib import Path

import pytest

from hil.page import PageSettings
from hil.page.access import Access
from hil.page.server import HEADERS, page_server
from hil.running import LoopThread
from hil.testing import make_loopback_authority
from recordings import BadInput

TOKEN = "0123456789abcdef-the-plant"
PATIENCE_S = 60.0


@dataclass(frozen=True)
class Reply:
    """An answer: status (0 where the connection was closed instead), headers, body."""

    status: int
    headers: Message
    body: str


@dataclass(frozen=True)
class Served:
    """A server of the page; asks it byte by byte."""

    access: Access
    port: int

    @property
    def origin(self) -> str:
        return self.access.url(self.port).rstrip("/")

    def ask(
        self, target: str = "/", *headers: str, method: str = "GET", host: str | None = None, body: str = ""
    ) -> Reply:
        """One request with exactly these bytes."""
        lines = [f"{method} {target} HTTP/1.1", f"Host: {host or f'127.0.0.1:{self.port}'}", *headers]
        lines += [f"Content-Length: {len(body)}"] if body else []
        keeps = any(one.startswith("Upgrade") for one in headers)
        lines += [] if keeps else ["Connection: close"]
        raw = "\r\n".join(lines).encode("latin-1") + b"\r\n\r\n" + body.encode()
        with ExitStack() as opened:
            peer = opened.enter_context(socket.create_connection(("127.0.0.1", self.port), PATIENCE_S))
            if self.access.token:
                context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
                context.load_verify_locations(self.access.certificate.with_name("ca.pem"))
                peer = opened.enter_context(context.wrap_socket(peer, server_hostname="127.0.0.1"))
            peer.sendall(raw)
            answer = b""
            with suppress(ConnectionResetError):  # a server that will not read on
                while (more := peer.recv(65536)) and not (keeps and b"\r\n\r\n" in answer + more):
                    answer += more
                answer += more
        if not answer:
            return Reply(0, Message(), "")
        head, _, rest = answer.decode("latin-1").partition("\r\n\r\n")
        first, _, names = head.partition("\r\n")
        return Reply(int(first.split()[1]), Parser().parsestr(names), rest)

    def handshake(self, path: str, *headers: str) -> Reply:
        """A websocket that asks to be opened."""
        key = "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ=="
        return self.ask(path, "Upgrade: websocket", "Connection: Upgrade", "Sec-WebSocket-Version: 13", key, *headers)


def running(settings: PageSettings) -> Iterator[Served]:
    access = settings.access()
    loop, opened = LoopThread("page server of a test"), ExitStack()

    async def begin() -> int:
        listening = access.bound()
        opened.enter_context(page_server(access, listening, {"/": lambda doc: None, "/valve": lambda doc: None}))
        return listening.getsockname()[1]

    async def end() -> None:
        opened.close()

    try:
        yield Served(access, loop.run(begin()))
    finally:
        loop.run(end())
        loop.close()


@pytest.fixture(scope="module")
def guarded_by(tmp_path_factory) -> Callable[..., PageSettings]:
    """Settings of a page that is exposed, in a way that tests can reach."""
    folder = tmp_path_factory.mktemp("guarded")
    server = make_loopback_authority(folder / "tls").server
    (folder / "token").write_text(f"{TOKEN}\n")
    usual = {"address": "127.0.0.1:0", "expose": True, "token": folder / "token"}
    usual |= {"certificate": server.certificate, "key": server.key}
    return lambda **other: PageSettings(**usual | other)


@pytest.fixture(scope="module")
def local() -> Iterator[Served]:
    yield from running(PageSettings())


@pytest.fixture(scope="module")
def guarded(guarded_by) -> Iterator[Served]:
    yield from running(guarded_by())


@pytest.mark.parametrize(
    "target",
    [
        "/static/js/../../../../../../../../etc/passwd",
        "/static/js/%2e%2e/%2e%2e/%2e%2e/%2e%2e/%2e%2e/%2e%2e/etc/passwd",
        "/static/js/..%2f..%2f..%2f..%2fetc/passwd", "/static//etc/passwd", "//etc/passwd", "/valve/../../etc/passwd",
        "/static/js/bokeh.min.js/../../../server.py", "/static/js/bokeh.js%00.min.js", "/autoload.js", "/metadata",
        "/valve/autoload.js", "/static/extensions/x/../../../etc/passwd", "/%2e%2e/%2e%2e/etc/passwd",
    ],
)  # fmt: skip
def test_nothing_but_the_page_can_be_fetched(local, target):
    reply = local.ask(target)
    assert reply.status == 404
    assert "root:" not in reply.body


def test_the_page_and_its_script_can_be_fetched(local):
    assert local.ask("/").status == 200
    script = local.ask("/static/js/bokeh.min.js")
    assert script.status == 200
    assert len(script.body) > 1_000_000


@pytest.mark.parametrize(
    ("target", "headers"),
    [
        ("/valve?tag=%0d%0aX-Injected:%201", ()), ("/%0d%0aX-Injected:%201", ()),
        ("/?bokeh-session-id=a%0d%0aX-Injected:1", ()),
        ("/", ("Bokeh-Session-Id: a%0d%0aX-Injected: 1",)), ("/", ("Origin: http://a\r\n\tX-Injected: 1",)),
        ("/valve", ("Cookie: a=\r\n\tX-Injected: 1",)),
    ],
)  # fmt: skip
def test_no_header_of_an_answer_comes_from_a_request(local, target, headers):
    reply = local.ask(target, *headers)
    assert "X-Injected" not in reply.headers
    assert reply.status in (200, 400, 403, 404)


@pytest.mark.parametrize("host", ["evil.example", "evil.example:80", "127.0.0.1:1", "127.0.0.1", "a b", "[::1"])
def test_a_server_on_loopback_answers_to_its_own_names_only(local, host):
    assert local.ask("/", host=host).status in (400, 403)


@pytest.mark.parametrize("path", ["/ws", "/valve/ws"])
@pytest.mark.parametrize(
    "origin", ["http://evil.example", "https://127.0.0.1.evil.example", "null", "http://127.0.0.1", None]
)
def test_a_websocket_from_another_site_is_refused(local, path, origin):
    assert local.handshake(path, *([f"Origin: {origin}"] if origin else [])).status == 403


def test_a_websocket_from_the_page_itself_is_opened(local):
    assert local.handshake("/ws", f"Origin: {local.origin}", "Sec-WebSocket-Protocol: bokeh, x").status == 101


def test_another_site_cannot_embed_it_nor_read_it_but_may_link_to_it(local):
    assert (
        local.ask("/", "Sec-Fetch-Site: cross-site", "Sec-Fetch-Mode: no-cors", "Sec-Fetch-Dest: script").status == 403
    )
    assert (
        local.ask("/", "Sec-Fetch-Site: cross-site", "Sec-Fetch-Mode: navigate", "Sec-Fetch-Dest: iframe").status == 403
    )
    assert (
        local.ask("/", "Sec-Fetch-Site: cross-site", "Sec-Fetch-Mode: navigate", "Sec-Fetch-Dest: document").status
        == 200
    )
    assert local.ask("/", "Origin: http://evil.example").status == 403
    assert "frame-ancestors 'none'" in local.ask("/").headers["Content-Security-Policy"]


@pytest.mark.parametrize("method", ["POST", "PUT", "DELETE", "OPTIONS", "PATCH"])
def test_nothing_can_be_sent_to_it(local, method):
    reply = local.ask("/", f"Origin: {local.origin}", method=method, body="x")
    assert reply.status == 405
    assert reply.body == "nothing can be changed here\n"


def test_a_large_request_is_not_read(local):
    assert local.ask("/", "Content-Length: 100000000", method="POST").status in (0, 400, 413)
    assert local.ask("/", f"Cookie: {'a' * 100_000}").status in (0, 400, 431)


@pytest.mark.parametrize("target", ["/", "/alive", "/nothing", "/static/js/bokeh.min.js", "/sign-in"])
def test_every_answer_says_that_nothing_comes_from_elsewhere(local, target):
    headers = local.ask(target).headers
    assert {name: headers[name] for name in HEADERS} == HEADERS
    assert "default-src 'none'" in headers["Content-Security-Policy"]
    assert "http:" not in headers["Content-Security-Policy"]
    assert "Access-Control-Allow-Origin" not in headers


@pytest.mark.parametrize("target", ["/alive", "/static/js/bokeh.min.js"])
@pytest.mark.parametrize(
    "header", ["X-None: 1", "Authorization: Bearer wrong", f"Authorization: Bearer {TOKEN[:-1]}",
               "Cookie: bristle_page=x", f"Cookie: bristle_page={TOKEN}", "Authorization: Bearer é"],
)  # fmt: skip
def test_without_the_token_nothing_is_given(guarded, target, header):
    assert guarded.ask(target, header).status == 401


def test_without_the_token_a_person_is_led_to_the_form_and_a_websocket_is_refused(guarded):
    reply = guarded.ask("/")
    assert (reply.status, reply.headers["Location"]) == (303, "/sign-in")
    assert guarded.handshake("/ws", f"Origin: {guarded.origin}").status == 401


def test_the_token_opens_it_to_a_script(guarded):
    assert guarded.ask("/", f"Authorization: Bearer {TOKEN}").status == 200


def test_a_person_signs_in_once(guarded):
    form = ("Content-Type: application/x-www-form-urlencoded", f"Origin: {guarded.origin}")
    wrong = guarded.ask("/sign-in", *form, method="POST", body="token=wrong")
    assert wrong.status == 403
    assert "Set-Cookie" not in wrong.headers
    right = guarded.ask("/sign-in", *form, method="POST", body=f"token={TOKEN}")
    assert (right.status, right.headers["Location"]) == (303, "/")
    cookie = right.headers["Set-Cookie"]
    assert TOKEN not in cookie
    assert all(word in cookie for word in ("HttpOnly", "Secure", "SameSite=Strict"))
    shown = f"Cookie: {cookie.split(';')[0]}"
    assert guarded.ask("/", shown).status == 200
    assert (
        guarded.handshake("/ws", shown, f"Origin: {guarded.origin}", "Sec-WebSocket-Protocol: bokeh, x").status == 101
    )
    assert guarded.handshake("/ws", shown, "Origin: https://evil.example").status == 403
    assert (
        guarded.ask("/sign-in", form[0], "Origin: http://evil.example", method="POST", body=f"token={TOKEN}").status
        == 403
    )


def test_the_token_is_compared_in_constant_time_and_in_no_other_way(guarded, monkeypatch):
    compared = []
    monkeypatch.setattr("hil.page.access.hmac.compare_digest", lambda a, b: bool(compared.append((a, b))))
    assert guarded.ask("/alive", f"Authorization: Bearer {TOKEN}").status == 401
    assert compared == [(TOKEN.encode(), TOKEN.encode())]
    assert guarded.ask("/alive", f"Cookie: bristle_page={guarded.access.cookie()}").status == 401
    assert len(compared) == 2


def test_the_token_stands_in_no_text_about_the_settings(guarded):
    assert TOKEN not in repr(guarded.access)


def test_a_page_for_other_machines_needs_token_and_tls(guarded_by):
    for missing, named in (("token", "page_token"), ("certificate", "page_cert"), ("key", "page_key")):
        with pytest.raises(BadInput, match="a token and over TLS") as refused:
            guarded_by(**{missing: None}).access()
        assert refused.value.parameters == (named,)
        assert "\n" not in str(refused.value)
    with pytest.raises(BadInput, match="other machines can reach"):
        PageSettings("0.0.0.0:0").access()


def test_what_is_given_for_an_exposed_page_is_checked(guarded_by, tmp_path):
    (tmp_path / "short").write_text("secret\n")
    with pytest.raises(BadInput, match="needs 16 at least"):
        guarded_by(token=tmp_path / "short").access()
    with pytest.raises(BadInput, match="cannot be read"):
        guarded_by(token=tmp_path / "none").access()
    with pytest.raises(BadInput, match="does not belong to"):
        guarded_by(key=Path(guarded_by().key).with_name("client.key")).access()


@pytest.mark.parametrize(
    "address", ["", "x", "127.0.0.1", "127.0.0.1:99999", "127.0.0.1:-1", "http://127.0.0.1:1", "::"]
)
def test_what_is_no_address_is_refused(address):
    with pytest.raises(BadInput, match="page: "):
        PageSettings(address).access()


def test_an_address_in_use_is_refused(local):
    with pytest.raises(BadInput, match="cannot be used"):
        PageSettings(f"127.0.0.1:{local.port}").access().bound()


def test_headers_are_text_that_a_browser_takes():
    assert json.dumps(HEADERS).isascii()
    assert not any("\n" in value for value in HEADERS.values())
