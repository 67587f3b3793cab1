"""The process of the page: ``python -m hil.page.process``, started by the monitor and ending with it."""

from __future__ import annotations

import asyncio
import logging
import os
import signal
import socket
import sys
from contextlib import suppress
from functools import partial
from io import FileIO, RawIOBase

from hil.page.exchange import LONGEST_LINE
from hil.page.feed import Feed
from hil.page.server import page_server
from hil.page.start import PageStart
from hil.page.views.plant import plant_document
from hil.page.views.valve import valve_document

NICENESS = 5
"""Acquisition goes first where the two share a processor."""


async def _main(questions: RawIOBase) -> None:
    answers = asyncio.StreamReader(limit=LONGEST_LINE)
    protocol = asyncio.StreamReaderProtocol(answers)
    await asyncio.get_running_loop().connect_read_pipe(lambda: protocol, sys.stdin.buffer)
    start = PageStart.model_validate_json(await answers.readline())
    feed = Feed(answers, questions)
    await feed.ask()  # whoever comes first sees something
    with socket.socket(fileno=start.listening) as listening:
        documents = {"/": partial(plant_document, feed), "/valve": partial(valve_document, feed, start.recordings)}
        with page_server(start.access, listening, documents):
            await feed.run()
            os._exit(0)  # the monitor has gone: nothing is left to save, and pages that are open would only complain


def main() -> None:
    """Serve until the pipe is closed."""
    questions = FileIO(os.dup(1), "wb")
    os.dup2(2, 1)  # whatever is printed must not stand among the questions
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the monitor hears it, and closes the pipe
    for name in ("tornado.access", "bokeh.server.views.ws"):  # who asks for nonsense, or leaves while something is
        logging.getLogger(name).setLevel(logging.ERROR)  # sent, shall not fill the journal
    os.nice(NICENESS)
    with suppress(ConnectionError):  # the monitor has gone
        asyncio.run(_main(questions))


if __name__ == "__main__":
    main()
