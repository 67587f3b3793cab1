"""The process of the page: ``python -m hil.page.process``, started by the monitor and ending with it."""

from __future__ import annotations

import asyncio
import os
import signal
import socket
import sys
from contextlib import suppress
from functools import partial

from hil.page.exchange import LONGEST_LINE
from hil.page.feed import Feed
from hil.page.server import page_server
from hil.page.start import PageStart
from hil.page.views.plant import plant_document
from hil.page.views.valve import valve_document

NICENESS = 5
"""Acquisition goes first where the two share a processor."""


async def _main(questions: int) -> None:
    reader, writer = await _pipe(questions)
    start = PageStart.model_validate_json(await reader.readline())
    feed = Feed(reader, writer)
    await feed.ask()  # whoever comes first sees something
    with socket.socket(fileno=start.listening) as listening:
        documents = {"/": partial(plant_document, feed), "/valve": partial(valve_document, feed, start.recordings)}
        with page_server(start.access, listening, documents):
            await feed.run()


async def _pipe(questions: int) -> tuple[asyncio.StreamReader, asyncio.StreamWriter]:
    """The pipe to the monitor: its answers on standard input, our questions to a number that nothing prints to."""
    loop = asyncio.get_running_loop()
    reader = asyncio.StreamReader(limit=LONGEST_LINE)
    await loop.connect_read_pipe(lambda: asyncio.StreamReaderProtocol(reader), sys.stdin.buffer)
    transport, protocol = await loop.connect_write_pipe(
        asyncio.streams.FlowControlMixin, os.fdopen(questions, "wb", buffering=0)
    )
    return reader, asyncio.StreamWriter(transport, protocol, reader, loop)


def main() -> None:
    """Serve until the pipe is closed."""
    questions = os.dup(1)
    os.dup2(2, 1)  # whatever is printed must not stand among the questions
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the monitor hears it, and closes the pipe
    os.nice(NICENESS)
    with suppress(ConnectionError, asyncio.IncompleteReadError):
        asyncio.run(_main(questions))


if __name__ == "__main__":
    main()
