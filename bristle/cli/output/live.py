"""Live values while something is recorded or watched: one changing line on a terminal, lines at times in a log."""

from __future__ import annotations

import shutil
import sys
from collections.abc import Mapping
from contextlib import suppress

from bristle.cli.output.manner import manner
from bristle.cli.output.terminal import plain_text
from hil import LinkEvent, Reading, Sample, Source, SourceWrapper

FIRST_S, LONGEST_S = 10.0, 60.0
"""In a log: when the first line comes, and the longest pause between two."""

FIRST_SHOWN = ("position", "setpoint", "drive", "pressure", "force", "flow")
"""What a reader looks for first."""

MOST_SHOWN = 6
"""Values of one valve in a line."""

HANDY: Mapping[str, tuple[float, str]] = {"m": (1e3, "mm"), "Pa": (1e-3, "kPa"), "1": (1e2, "%")}
"""Factor and unit in which values of a unit are read off."""


class Latest(SourceWrapper):
    """A source that is read through this one. `samples` : the last of each valve, by name."""

    def __init__(self, source: Source) -> None:
        super().__init__(source)
        self.samples: dict[str, Sample] = {}

    async def __anext__(self) -> Sample | LinkEvent:
        item = await anext(self._source)
        if isinstance(item, Sample):
            self.samples[item.valve] = item
        return item

    def words(self) -> str:
        """The last values of all valves."""
        several = len(self.samples) > 1
        return "; ".join(
            f"{name}: {values_of(one)}" if several else values_of(one) for name, one in self.samples.items()
        )


def values_of(sample: Sample) -> str:
    """The values of a sample, the most wanted first, and how many of all cannot be used."""
    readings = sample.readings
    order = [name for name in FIRST_SHOWN if name in readings]
    order += [name for name in readings if name not in order]
    shown = [f"{name} {reading_words(readings[name])}" for name in order[:MOST_SHOWN]]
    bad = sum(not one.good for one in readings.values())
    return "  ".join([*shown, *([f"({bad} of {len(readings)} not good)"] if bad else [])])


def reading_words(reading: Reading) -> str:
    """A value in a handy unit, or what is wrong with it.

    >>> reading_words(Reading(0.0123, "m")), reading_words(Reading(0.5, "1"))
    ('12.3 mm', '50 %')
    """
    if not reading.good:
        return str(reading.quality)
    factor, unit = HANDY.get(reading.unit, (1.0, reading.unit))
    return f"{factor * reading.value:.4g} {unit}".rstrip()


class LiveLine:
    """The line itself, on stderr. It says nothing with ``--quiet``."""

    def __init__(self) -> None:
        self._mute, self._terminal = manner().quiet, sys.stderr.isatty()
        self._due_s, self._pause_s, self._standing = FIRST_S, FIRST_S, False

    def update(self, seconds: float, text: str) -> None:
        """Say how things stand, `seconds` after the start."""
        if self._mute:
            return
        line = plain_text(f"{seconds:6.0f} s  {text}")
        if self._terminal:
            width = shutil.get_terminal_size().columns - 1
            print(f"\r{line[:width]}\033[K", end="", file=sys.stderr, flush=True)
            self._standing = True
        elif seconds >= self._due_s:
            print(line, file=sys.stderr, flush=True)
            self._due_s, self._pause_s = seconds + self._pause_s, min(2 * self._pause_s, LONGEST_S)

    def say(self, text: str) -> None:
        """Something else, on a line of its own."""
        if not self._mute:
            self.end()
            print(plain_text(text), file=sys.stderr, flush=True)

    def end(self) -> None:
        """Leave the line as it stands."""
        if self._standing:
            self._standing = False
            with suppress(OSError):  # the terminal may have gone
                print(file=sys.stderr, flush=True)
