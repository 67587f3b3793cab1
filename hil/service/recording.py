"""Recording of one valve: its queue as a source, and the recorder that drains it to the disk."""

from __future__ import annotations

import asyncio
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from types import TracebackType
from typing import Self

from hil.recorder.files import RecorderSettings
from hil.recorder.notes import Notes
from hil.recorder.recorder import Recorder
from hil.service.acquisition import ItemQueue
from hil.service.plan import ValvePlan
from hil.service.plant_file import RecordingEntry
from hil.source.sample import LinkEvent, Sample
from hil.source.statistics import Statistics
from recordings import Plant, SignalSpec

NAP_S = 0.5

BATCH_S = 2.0
"""Samples wait so long for the disk [s]: it costs by the batch, and valves are many. So much a power cut takes."""

HOLD_S = 30.0
"""For so long they are in the journal alone [s]: the HDF5 file costs ten times as much a write."""


class QueuedSource:
    """What waits in a queue, as a source: it ends when it is empty and `ending` is set."""

    def __init__(self, tag: str, signals: tuple[SignalSpec, ...], queue: ItemQueue, ending: asyncio.Event) -> None:
        self.signals: Mapping[str, tuple[SignalSpec, ...]] = {tag: signals}
        self.statistics = Statistics()
        self._queue, self._ending = queue, ending
        self._taken: list[Sample | LinkEvent] = []

    async def __aenter__(self) -> Self:
        return self

    async def __aexit__(self, kind: type | None, error: BaseException | None, trace: TracebackType | None) -> None:
        return None

    def __aiter__(self) -> Self:
        return self

    async def __anext__(self) -> Sample | LinkEvent:
        while not self._taken:
            self._taken = self._queue.take(256)[::-1]
            if not self._taken:
                if self._ending.is_set():
                    raise StopAsyncIteration
                await asyncio.sleep(NAP_S)
            self.statistics.samples += sum(isinstance(item, Sample) for item in self._taken)
        return self._taken.pop()


class ValveRecording:
    """Records one valve.

    disk : thread that all recordings share. `safe` is how many samples of this service nothing can take any more;
    `lost` how many were taken from the queue and could not be written; `notes` become events of the recording.
    """

    def __init__(
        self,
        plan: ValvePlan,
        entry: RecordingEntry,
        folder: Path,
        queue: ItemQueue,
        disk: ThreadPoolExecutor,
        ending: asyncio.Event,
    ) -> None:
        self.plan, self._queue, self._disk, self._ending = plan, queue, disk, ending
        self.safe, self.lost, self.notes = 0, 0, Notes()
        self._source: QueuedSource | None = None
        self._safe_before = 0
        self._file, self._in_file = Path(), 0
        stroke, area = plan.known("stroke_m"), plan.known("diaphragm_area_m2")
        self._settings = RecorderSettings(
            to=folder,
            rotate_s=3600.0 * entry.rotate_hours,
            rotate_mb=entry.rotate_mb,
            plant=Plant(tag=plan.tag, stroke_m=stroke, diaphragm_area_m2=area),
            acknowledge=self._acknowledge,
            notes=self.notes,
            batch_s=BATCH_S,
            hold_s=HOLD_S,
            refuse_unusable=False,
        )

    async def run(self) -> None:
        """Record until told to end. Raises what the recorder raises."""
        self._safe_before = self.safe
        self._source = QueuedSource(self.plan.tag, self.plan.signals, self._queue, self._ending)
        try:
            await Recorder(self._source, self._settings, self._disk).run(asyncio.Event())
        finally:
            self.lost += self.unsafe
            self._source = None

    @property
    def unsafe(self) -> int:
        """How many samples were taken from the queue and still wait for the disk."""
        return 0 if self._source is None else self._source.statistics.samples - (self.safe - self._safe_before)

    def _acknowledge(self, path: Path, n_samples: int) -> None:
        if path != self._file:
            self._file, self._in_file = path, 0
        self.safe += n_samples - self._in_file
        self._in_file = n_samples
