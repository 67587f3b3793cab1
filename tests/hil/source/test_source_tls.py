"""Modbus/TCP Security: both sides show certificates, and whatever is wrong with them is said in one line."""

from __future__ import annotations

import asyncio
from datetime import UTC, datetime, timedelta

import pytest
from link_peers import TcpPeer, within
from link_rig import MAP, Rig, samples

from hil import LinkEvent, LiveSource, Polling, Sample, parse_address, valves_of
from hil.testing import LoopbackAuthority, make_loopback_authority
from recordings import BadInput


@pytest.fixture(scope="module")
def trusted(tmp_path_factory) -> LoopbackAuthority:
    return make_loopback_authority(tmp_path_factory.mktemp("trusted"))


@pytest.fixture(scope="module")
def stranger(tmp_path_factory) -> LoopbackAuthority:
    return make_loopback_authority(tmp_path_factory.mktemp("stranger"))


def address(
    peer: TcpPeer, authority: LoopbackAuthority, own: LoopbackAuthority | None = None, options: str = ""
) -> str:
    mine = (own or authority).client
    files = f"ca={authority.client.authority}&cert={mine.certificate}&key={mine.key}"
    return f"tls://127.0.0.1:{peer.port}?{files}{options}"


def source(text: str) -> LiveSource:
    return LiveSource(parse_address(text), valves_of(MAP), Polling(None))


def serving(authority: LoopbackAuthority) -> TcpPeer:
    return TcpPeer(Rig(), context=authority.server.server_context())


async def first_item(server: LoopbackAuthority, *who: LoopbackAuthority, options: str = "") -> Sample | LinkEvent:
    """What a source says first to a server. who : whom the client trusts, and who vouches for it."""
    async with serving(server) as peer, source(address(peer, *who, options=options)) as one:
        return await within(anext(one))


def test_samples_come_over_tls_and_after_an_outage_again(trusted):
    async def story() -> list[float]:
        async with serving(trusted) as peer, source(address(peer, trusted)) as one:
            first = await samples(one, 3)
            peer.drop()
            return [sample["counter"].value for sample in first + await samples(one, 3)]

    counters = asyncio.run(story())
    assert counters[:3] == [1, 2, 3]
    assert counters == sorted(set(counters))


def test_a_server_of_a_foreign_authority_is_refused_at_start(trusted, stranger):
    with pytest.raises(BadInput, match="do not accept each other's certificates"):
        asyncio.run(first_item(stranger, trusted))


def test_a_server_with_another_name_is_refused_at_start(trusted):
    with pytest.raises(BadInput, match="do not accept each other's certificates"):
        asyncio.run(first_item(trusted, trusted, options="&name=plc.example"))


def test_a_client_certificate_that_the_server_does_not_know_gives_no_samples(trusted, stranger):
    """The server's refusal comes after the handshake, and the reason may get lost with the connection."""
    said: object
    try:
        said = asyncio.run(first_item(trusted, trusted, stranger))
    except BadInput as problem:
        said = problem
    assert isinstance(said, BadInput) or (isinstance(said, LinkEvent) and said.kind == "link_down")


def test_files_that_are_missing_wrong_or_expired_are_named(trusted, stranger, tmp_path):
    past = datetime.now(UTC) - timedelta(days=400)
    expired = make_loopback_authority(tmp_path / "expired", days=30, start=past)
    future = make_loopback_authority(tmp_path / "future", days=30, start=datetime.now(UTC) + timedelta(days=10))
    (tmp_path / "text.pem").write_text("not a certificate")
    client = trusted.client
    cases = [
        (client.authority, expired.client.certificate, expired.client.key, "expired on"),
        (future.client.authority, client.certificate, client.key, "valid only from"),
        (tmp_path / "nothing.pem", client.certificate, client.key, "cannot be read"),
        (tmp_path / "text.pem", client.certificate, client.key, "certificate"),
        (client.authority, tmp_path / "text.pem", client.key, "certificate"),
        (client.authority, client.certificate, stranger.client.key, "key"),
        (client.authority, client.certificate, tmp_path / "text.pem", "key"),
    ]
    for ca, cert, key, words in cases:
        with pytest.raises(BadInput, match=words) as problem:
            source(f"tls://127.0.0.1:802?ca={ca}&cert={cert}&key={key}")
        assert "\n" not in str(problem.value)
