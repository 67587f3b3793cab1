"""Modbus/TCP Security with real certificates: who is let in, and what is said of files that cannot be used."""

from __future__ import annotations

import asyncio
import contextlib
import dataclasses
import os
import ssl
from datetime import UTC, datetime, timedelta

import pytest
from cryptography import x509
from pymodbus.client import AsyncModbusTcpClient, AsyncModbusTlsClient
from served_ramp import Ramp, connected, port_of, settings

from hil import Certificates, Server
from hil.server import handler
from hil.testing import make_loopback_authority
from recordings import BadInput


@pytest.fixture(scope="module")
def authority(tmp_path_factory):
    return make_loopback_authority(tmp_path_factory.mktemp("tls") / "ca")


@pytest.fixture(scope="module")
def stranger(tmp_path_factory):
    return make_loopback_authority(tmp_path_factory.mktemp("tls") / "other")


def context_for(side, *, certificate=True):
    """What a client of our own making would use: no check of ours is involved."""
    context = ssl.create_default_context(cafile=side.authority)
    if certificate:
        context.load_cert_chain(side.certificate, side.key)
    return context


async def answer(context, port):
    """The exception code or the registers of one read over TLS; None when the server does not let us in."""
    client = AsyncModbusTlsClient("127.0.0.1", port=port, sslctx=context, timeout=1, retries=0, reconnect_delay=0)
    try:
        if not await client.connect():
            return None
        # with TLS 1.3 a server turns a client away only after the client believes it is connected
        with contextlib.suppress(Exception):
            return (await client.read_input_registers(22, count=1, device_id=1)).registers
        return None
    finally:
        client.close()


def served(authority, context):
    async def main():
        s = settings("tls://127.0.0.1:0", speed=None, certificates=authority.server)
        async with Server({1: Ramp()}, s) as server:
            port = port_of(server.addresses[0])
            wanted = await answer(context, port)
            assert await answer(context_for(authority.client), port) == [3]
            return wanted

    return asyncio.run(main())


def test_a_client_with_a_certificate_of_the_authority_is_served(authority):
    assert served(authority, context_for(authority.client)) == [3]


def test_a_client_without_a_certificate_is_turned_away(authority):
    assert served(authority, context_for(authority.client, certificate=False)) is None


def test_a_client_of_another_authority_is_turned_away(authority, stranger):
    context = context_for(authority.client, certificate=False)
    context.load_cert_chain(stranger.client.certificate, stranger.client.key)
    assert served(authority, context) is None


def test_a_client_whose_certificate_expired_is_turned_away(authority, tmp_path):
    expired = make_loopback_authority(tmp_path / "old", days=1, start=datetime.now(UTC) - timedelta(days=9))
    context = context_for(authority.client, certificate=False)
    context.load_cert_chain(expired.client.certificate, expired.client.key)
    assert served(authority, context) is None


def test_a_client_that_does_not_know_the_authority_does_not_talk_to_the_server(authority, stranger):
    assert served(authority, context_for(stranger.client)) is None


@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_tls_older_than_1_2_is_turned_away(authority):
    context = context_for(authority.client)
    context.set_ciphers("ALL:@SECLEVEL=0")
    context.minimum_version = ssl.TLSVersion.TLSv1
    context.maximum_version = ssl.TLSVersion.TLSv1_1
    assert served(authority, context) is None


def test_a_client_without_tls_gets_nothing_and_the_server_goes_on(authority):
    async def main():
        s = settings("tls://127.0.0.1:0", speed=None, certificates=authority.server)
        async with Server({1: Ramp()}, s) as server:
            port = port_of(server.addresses[0])
            plain = AsyncModbusTcpClient("127.0.0.1", port=port, timeout=0.5, retries=0, reconnect_delay=0)
            assert await plain.connect()
            with pytest.raises(Exception, match=r"(?i)response|connect"):
                await plain.read_input_registers(22, count=1, device_id=1)
            plain.close()
            assert await answer(context_for(authority.client), port) == [3]

    asyncio.run(main())


async def end_of(reader):
    """What a client reads when it is sent away."""
    with contextlib.suppress(ConnectionError):
        return await asyncio.wait_for(reader.read(1), 5)
    return b""


def test_clients_that_never_end_their_handshake_shut_nobody_out_on_any_listener(authority, monkeypatch):
    """Thirty of them, where eight clients have room: one that polls stays, and a new one gets in."""
    monkeypatch.setattr(handler, "MOST_CONNECTIONS", 8)

    async def main():
        s = settings("tcp://127.0.0.1:0", "tls://127.0.0.1:0", speed=None, certificates=authority.server)
        async with Server({1: Ramp()}, s) as server, connected(server) as polling:
            port, silent = port_of(server.addresses[1]), []
            for _ in range(30):
                silent.append(await asyncio.open_connection("127.0.0.1", port))
                assert not (await polling.read_input_registers(0, count=1, device_id=1)).isError()
            assert await answer(context_for(authority.client), port) == [3]
            ends = [await end_of(reader) for reader, _ in silent[:20]]
            for _, writer in silent:
                writer.close()
            return ends

    assert asyncio.run(main()) == [b""] * 20


def test_a_client_that_never_ends_its_handshake_is_sent_away(authority, monkeypatch):
    monkeypatch.setattr(handler, "HANDSHAKE_S", 0.05)

    async def main():
        s = settings("tls://127.0.0.1:0", speed=None, certificates=authority.server)
        async with Server({1: Ramp()}, s) as server:
            reader, writer = await asyncio.open_connection("127.0.0.1", port_of(server.addresses[0]))
            end = await end_of(reader)
            writer.close()
            return end

    assert asyncio.run(main()) == b""


def test_the_test_authority_vouches_for_loopback_only_and_keeps_its_keys_private(authority):
    folder = authority.server.certificate.parent
    assert {path.name for path in folder.iterdir()} == {
        "ca.pem",
        "server.pem",
        "server.key",
        "client.pem",
        "client.key",
    }
    assert [os.stat(folder / f"{side}.key").st_mode & 0o777 for side in ("server", "client")] == [0o600, 0o600]
    certificate = x509.load_pem_x509_certificate(authority.server.authority.read_bytes())
    limits = certificate.extensions.get_extension_for_class(x509.NameConstraints)
    assert limits.critical
    assert {str(name.value) for name in limits.value.permitted_subtrees} == {"localhost", "127.0.0.0/8", "::1/128"}


def test_a_test_authority_never_overwrites(authority):
    with pytest.raises(BadInput, match="already there"):
        make_loopback_authority(authority.server.certificate.parent)


def test_a_test_authority_needs_a_folder_it_can_write(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(BadInput, match="cannot be written"):
        make_loopback_authority(tmp_path / "file" / "ca")


def test_certificates_that_cannot_be_used_are_refused_in_words(authority, stranger, tmp_path):
    good = authority.server
    (tmp_path / "noise.pem").write_text("nothing")
    locked = tmp_path / "locked.key"
    locked.write_bytes(_locked(good.key))
    expired = make_loopback_authority(tmp_path / "old", days=1, start=datetime.now(UTC) - timedelta(days=9)).server
    early = make_loopback_authority(tmp_path / "new", days=9, start=datetime.now(UTC) + timedelta(days=1)).server
    for changes, words in (
        ({"certificate": tmp_path / "none.pem"}, "none.pem: cannot be read"),
        ({"certificate": tmp_path / "noise.pem"}, "noise.pem: not a certificate"),
        ({"authority": tmp_path}, "cannot be read"),
        ({"authority": good.certificate}, "not a certificate authority"),
        ({"key": stranger.server.key}, "does not belong to"),
        ({"key": good.certificate}, "not a private key"),
        ({"key": locked}, "has a password"),
        ({"certificate": expired.certificate, "key": expired.key}, "server.pem: the certificate expired on"),
        ({"authority": expired.authority}, "ca.pem: the certificate expired on"),
        ({"certificate": early.certificate, "key": early.key}, "valid only from"),
    ):
        with pytest.raises(BadInput) as refusal:
            dataclasses.replace(good, **changes).server_context()
        assert words in str(refusal.value)


def test_a_tls_address_needs_certificates():
    async def main():
        async with Server({1: Ramp()}, settings("tls://127.0.0.1:0")):
            pass

    with pytest.raises(BadInput, match="give certificate"):
        asyncio.run(main())


def test_the_certificates_are_checked_before_anybody_connects(authority, stranger):
    async def main():
        mixed = Certificates(authority.server.certificate, stranger.server.key, authority.server.authority)
        async with Server({1: Ramp()}, settings("tcp://127.0.0.1:0", "tls://127.0.0.1:0", certificates=mixed)):
            pass

    with pytest.raises(BadInput, match="does not belong"):
        asyncio.run(main())


def _locked(path):
    from cryptography.hazmat.primitives import serialization as s

    key = s.load_pem_private_key(path.read_bytes(), None)
    return key.private_bytes(s.Encoding.PEM, s.PrivateFormat.PKCS8, s.BestAvailableEncryption(b"secret"))
