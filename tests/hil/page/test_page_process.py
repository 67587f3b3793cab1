"""The process of the page beside the monitor: it listens where it was told, makes nobody wait, and ends with it."""

from __future__ import annotations

import asyncio
import os
import signal
import urllib.request
from io import RawIOBase
from pathlib import Path

import pytest
from page_rig import PATIENCE_S, Shown, valve

from hil.page import Page, PageSettings
from hil.page.exchange import answered
from hil.page.feed import Feed
from hil.testing import make_loopback_authority

LISTENING = "0A"
"""A state of `/proc/net/tcp`."""


class Asked(Shown):
    """Counts the questions of the page."""

    questions = 0

    def status(self):
        self.questions += 1
        return super().status()


async def fetched(url: str) -> str:
    def fetch() -> str:
        with urllib.request.urlopen(url, timeout=PATIENCE_S) as answer:
            return answer.read().decode()

    return await asyncio.to_thread(fetch)


async def until(condition, patience: float = PATIENCE_S) -> None:
    async with asyncio.timeout(patience):
        while not condition():
            await asyncio.sleep(0.02)


def listening(process: int) -> set[str]:
    """Addresses (hexadecimal, with ports) on which a process listens."""
    links = [os.readlink(one) for one in Path(f"/proc/{process}/fd").iterdir() if one.is_symlink()]
    own = {link[8:-1] for link in links if link.startswith("socket:")}
    rows = [line.split() for kind in ("tcp", "tcp6") for line in Path(f"/proc/net/{kind}").read_text().splitlines()[1:]]
    return {row[1] for row in rows if row[3] == LISTENING and row[9] in own}


@pytest.mark.slow
def test_it_listens_on_its_address_alone_makes_nobody_wait_is_begun_anew_and_ends_with_the_monitor(monkeypatch):
    monkeypatch.setenv("BOKEH_RESOURCES", "cdn")
    monkeypatch.setenv("BOKEH_ALLOW_WS_ORIGIN", "*")
    shown = Asked(valve("LC74_20"))

    async def story() -> None:
        with Page(PageSettings(), shown) as page:
            task = asyncio.create_task(page.always())
            html = await fetched(page.url)
            assert "LC74_20" in html
            assert "cdn" not in html
            first = page.process
            port = int(page.url.rstrip("/").rpartition(":")[2])
            assert listening(first) == {f"0100007F:{port:04X}"}
            assert "BOKEH" not in Path(f"/proc/{first}/environ").read_text()
            os.kill(first, signal.SIGSTOP)
            await asyncio.sleep(0.5)  # longer than between two questions
            asked = shown.questions
            for _ in range(200):  # whatever else the monitor does goes on
                await asyncio.sleep(0.001)
            assert shown.questions == asked
            os.kill(first, signal.SIGKILL)
            await until(lambda: page.process not in (None, first))
            await until(lambda: shown.questions > asked)
            last = page.process
            task.cancel()
            await asyncio.gather(task, return_exceptions=True)
            assert not Path(f"/proc/{last}").exists()

    asyncio.run(story())


def test_the_token_is_in_no_list_of_processes(tmp_path):
    server = make_loopback_authority(tmp_path / "tls").server
    (tmp_path / "token").write_text("0123456789abcdef-secret")
    settings = PageSettings("0", True, tmp_path / "token", server.certificate, server.key)

    async def story() -> None:
        with Page(settings, Shown(valve("LC74_20"))) as page:
            assert page.url.startswith("https://127.0.0.1:")
            task = asyncio.create_task(page.run())
            await until(lambda: page.process is not None)
            about = Path(f"/proc/{page.process}")
            assert b"secret" not in (about / "cmdline").read_bytes() + (about / "environ").read_bytes()
            task.cancel()
            await asyncio.gather(task, return_exceptions=True)

    asyncio.run(story())


class Answering(RawIOBase):
    """A pipe to a monitor that answers every question at once."""

    def __init__(self, answers: asyncio.StreamReader, watched: Shown) -> None:
        self.questions, self._answers, self._watched = 0, answers, watched

    def write(self, line: bytes) -> int:
        self.questions += 1
        self._answers.feed_data(answered(line, self._watched))
        return len(line)


def test_the_monitor_is_asked_seldom_while_nobody_looks_and_at_once_when_somebody_comes(monkeypatch):
    monkeypatch.setattr("hil.page.feed.UNSEEN_S", 1e6)

    async def story() -> None:
        answers = asyncio.StreamReader()
        pipe = Answering(answers, Shown(valve("LC74_20")))
        feed = Feed(answers, pipe)
        task = asyncio.create_task(feed.run())
        await until(lambda: feed.status is not None)
        for _ in range(100):
            await asyncio.sleep(0.005)
        assert pipe.questions == 1
        monkeypatch.setattr("hil.page.feed.USUAL_S", 0.0)
        assert feed.silence is None, "one that was not asked is not silent"
        feed.open()
        await until(lambda: pipe.questions >= 4)
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)

    asyncio.run(story())
