"""Live values of what is recorded or watched: one line that changes on a terminal, lines now and then in a log."""

from __future__ import annotations

import asyncio
import sys

import pytest

from bristle.cli.output.live import Latest, LiveLine, values_of
from bristle.cli.output.manner import begin
from hil import Quality, Reading, Sample, Statistics

READINGS = {
    "temperature": Reading(21.0, "degC"),
    "pressure": Reading(1.8e5, "Pa"),
    "position": Reading(0.0123, "m"),
    "status": Reading(float("nan"), "1", Quality.NOT_VALID, "outside"),
}


class OneSample:
    """A source with one sample."""

    def __init__(self) -> None:
        self.signals: dict[str, tuple[object, ...]] = {}
        self.statistics, self._left = Statistics(), 1

    async def __anext__(self) -> Sample:
        self._left -= 1
        if self._left < 0:
            raise StopAsyncIteration
        return Sample(1.0, 0.0, "LC74_20", READINGS)


@pytest.fixture(autouse=True)
def _usual():
    begin([])


def test_what_a_reader_looks_for_stands_first_in_handy_units():
    words = values_of(Sample(1.0, 0.0, "V", READINGS))
    assert words == "position 12.3 mm  pressure 180 kPa  temperature 21 degC  status not valid  (1 of 4 not good)"


def test_the_last_sample_is_kept_while_it_passes():
    async def taken() -> tuple[Sample, str]:
        source = Latest(OneSample())
        return await anext(source), source.words()

    sample, words = asyncio.run(taken())
    assert words == values_of(sample)


def test_a_log_gets_lines_now_and_then(capsys):
    line = LiveLine()
    for second in range(1, 41):
        line.update(second, "watching")
    assert capsys.readouterr().err.splitlines() == ["    10 s  watching", "    20 s  watching", "    40 s  watching"]


def test_a_terminal_gets_one_line_that_changes_and_events_beside_it(capsys, monkeypatch):
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    monkeypatch.setenv("COLUMNS", "30")
    line = LiveLine()
    line.update(1.0, "x" * 100)
    line.update(2.0, "position 12.3 mm")
    line.say("V: link_down")
    line.end()
    err = capsys.readouterr().err
    assert err == f"\r     1 s  {'x' * 19}\033[K\r     2 s  position 12.3 mm\033[K\nV: link_down\n"


def test_quiet_is_quiet(capsys):
    begin(["monitor", "--quiet"])
    line = LiveLine()
    line.update(100.0, "watching")
    line.say("V: link_down")
    assert capsys.readouterr().err == ""
