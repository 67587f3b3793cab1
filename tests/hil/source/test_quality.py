"""Which events values make that are not good: few, however often they come and go."""

from __future__ import annotations

import math

from hil import LinkEvent, Quality, Reading, Sample
from hil.source.quality import Episodes

PERIOD_S = 0.1


def told(seconds: float, bad_every_s: float) -> list[LinkEvent]:
    """The events of a value that is out of its range for one sample now and then."""
    episodes, events = Episodes(), []
    for k in range(round(seconds / PERIOD_S)):
        bad = k % round(bad_every_s / PERIOD_S) == 0
        reading = Reading(math.nan, "t/h", Quality.OUT_OF_RANGE, "41 outside 0 to 40") if bad else Reading(3.0, "t/h")
        events += episodes.observe(Sample(PERIOD_S * k, 1.7e9 + PERIOD_S * k, "V", {"flow": reading}))
    return events


def test_a_value_that_comes_and_goes_is_one_trouble_that_lasts():
    events = told(seconds=3600.0, bad_every_s=1.5)
    assert [event.text for event in events] == [
        "flow: out of range: 41 outside 0 to 40",
        "flow: good again, 1 samples were not",
        "flow: out of range: 41 outside 0 to 40",
    ]


def test_troubles_far_apart_are_each_told_as_one():
    events = told(seconds=600.0, bad_every_s=60.0)
    assert len(events) == 20
    assert {event.text for event in events[1::2]} == {"flow: good again, 1 samples were not"}
    assert all(over.time - begun.time < 1.2 for begun, over in zip(events[::2], events[1::2], strict=True))
