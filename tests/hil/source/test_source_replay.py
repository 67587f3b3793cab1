"""A recording played back through the same interface as a live link."""

from __future__ import annotations

import asyncio
from datetime import UTC, datetime

import numpy as np
import pytest

from hil import LinkEvent, Quality, Sample, open_source
from recordings import BadInput, Event, Plant, Recording, Signal, write


@pytest.fixture
def path(tmp_path):
    clock = Signal("time", np.array([5.0, 5.5, 6.5]), "s", "time")
    travel = Signal("position", np.array([1.0, np.nan, 3.0]), "mm", "output")
    events = [Event(6.0, "gap", "no reply"), Event(5.2, "note", "the operator coughed")]
    made = datetime(2026, 1, 2, tzinfo=UTC)
    recording = Recording.of([clock, travel], plant=Plant(tag="LC74"), created=made, events=events)
    write(tmp_path / "run.h5", recording)
    return tmp_path / "run.h5"


def played(address: str, name: str | None = None) -> list[Sample | LinkEvent]:
    async def story() -> list[Sample | LinkEvent]:
        async with open_source(address, name=name) as source:
            return [item async for item in source]

    return asyncio.run(story())


def test_samples_and_the_sources_own_events_come_in_the_order_of_time(path):
    items = played(f"replay:{path}")
    assert [type(item).__name__ for item in items] == ["Sample", "Sample", "LinkEvent", "Sample"]
    assert [item.time for item in items] == [5.0, 5.5, 6.0, 6.5]
    assert (items[0].valve, items[0]["position"].value, items[0]["position"].unit) == ("LC74", 1.0, "mm")
    assert items[0].at == datetime(2026, 1, 2, 0, 0, 5, tzinfo=UTC)
    assert items[2].text == "no reply"


def test_a_missing_value_is_bad(path):
    reading = played(f"replay:{path}")[1]["position"]
    assert (reading.quality, reading.reason) == (Quality.NOT_VALID, "missing in the recording")


def test_a_paced_recording_takes_its_time(path):
    loop_times = []

    async def story() -> None:
        async with open_source(f"replay:{path}?pace=20") as source:
            async for item in source:
                if isinstance(item, Sample):
                    loop_times.append(asyncio.get_running_loop().time())

    asyncio.run(story())
    assert loop_times[-1] - loop_times[0] >= 1.5 / 20 - 0.001


def test_the_valve_can_be_named_and_a_missing_file_is_bad_input(path):
    assert played(f"replay:{path}", "V1")[0].valve == "V1"
    with pytest.raises(BadInput, match="no such file"):
        played(f"replay:{path.parent}/nothing.h5")
