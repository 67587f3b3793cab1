"""A plant file made ready to run: maps, models and sources loaded and checked, in words, without a packet."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from hil.monitor.monitor import Monitor, OnLearned
from hil.registers.register_map import RegisterMap
from hil.service.plant_file import PlantFile, SourceEntry, ValveEntry
from hil.source.address import ReplayAddress, parse_address
from hil.source.live import ReadingPlan
from hil.source.polling import Polling
from hil.source.ring_reading import RingReading
from hil.source.source import Source, open_source
from hil.source.valve import Valve
from recordings import BadInput, SignalSpec
from simulator import ValveModel


@dataclass(frozen=True)
class ValvePlan:
    """One valve, ready to be watched. signals : what its samples bring; model_file : where the model came from."""

    entry: ValveEntry
    model: ValveModel
    model_file: Path
    signals: tuple[SignalSpec, ...]
    calibrate: tuple[Path, ...]
    false_alarms: float
    own_clock: bool

    @property
    def tag(self) -> str:
        """The valve's name."""
        return self.entry.tag

    @property
    def model_key(self) -> str:
        """Names the model that a state belongs to."""
        return self.model.model_dump_json()

    def known(self, name: str) -> float | None:
        """A number that the model knows of the plant, ``stroke_m`` for example."""
        value = self.model.plant.get(name)
        return value if isinstance(value, float) else None

    def monitor(self, on_learned: OnLearned | None = None) -> Monitor:
        """A monitor for this valve alone. Raises BadInput for signals that it cannot use."""
        return Monitor.with_model(
            {self.tag: self.signals}, self.model, self.false_alarms, self.entry.learn_s, own_clock=self.own_clock,
            on_learned=on_learned,
        )  # fmt: skip


@dataclass(frozen=True)
class SourcePlan:
    """One source and its valves. polled : the valves as the source reads them, empty for a recording."""

    entry: SourceEntry
    address: str
    reading: ReadingPlan
    polled: tuple[Valve, ...]
    valves: tuple[ValvePlan, ...]
    ends: bool

    @property
    def rate_hz(self) -> float:
        """Rounds a second."""
        return self.entry.rate_hz

    @property
    def shown(self) -> str:
        """The address without its options, which may name keys."""
        return self.address.partition("?")[0]

    def open(self) -> Source:
        """A new source; it only reads."""
        return open_source(self.address, self.polled, self.reading, name=self.valves[0].tag if self.ends else None)


@dataclass(frozen=True)
class ServicePlan:
    """Everything that a service is to do."""

    plant: PlantFile
    sources: tuple[SourcePlan, ...]

    @property
    def valves(self) -> tuple[ValvePlan, ...]:
        """All valves, in the file's order."""
        return tuple(valve for source in self.sources for valve in source.valves)

    @classmethod
    def of(cls, plant: PlantFile) -> ServicePlan:
        """Load what a plant file names. Raises BadInput naming the plant file, the item, and the remedy."""
        return cls(plant, tuple(_source(plant, k, entry) for k, entry in enumerate(plant.source)))

    def words(self) -> str:
        """What would be polled, from where, how often, and where everything goes: one line each."""
        return "\n".join(_words(self))


def _source(plant: PlantFile, place: int, entry: SourceEntry) -> SourcePlan:
    where = f"{plant.file}: source[{place}]"
    try:
        parsed = parse_address(entry.address)
        ends = isinstance(parsed, ReplayAddress)
        address = f"replay:{plant.recording(str(parsed.path))}" if isinstance(parsed, ReplayAddress) else entry.address
        if isinstance(parsed, ReplayAddress) and parsed.pace is not None:
            address += f"?pace={parsed.pace:g}"
        if ends and len(entry.valve) > 1:
            raise BadInput("valve", "a recording is of one valve", "give each recording a source of its own")
        if entry.ring:
            reading: ReadingPlan = RingReading(entry.rate_hz)
        else:
            reading = Polling(entry.rate_hz, entry.heartbeat, entry.heartbeat_s)
        polled = () if ends else tuple(_polled(plant, k, one) for k, one in enumerate(entry.valve))
        name = entry.valve[0].tag if ends else None
        signals = open_source(address, polled, reading, name=name).signals
        valves = tuple(_valve(plant, k, one, signals, ends) for k, one in enumerate(entry.valve))
    except BadInput as problem:
        raise BadInput(f"{where}: {problem.where}", problem.found, problem.remedy) from None
    return SourcePlan(entry, address, reading, polled, valves, ends)


def _polled(plant: PlantFile, place: int, entry: ValveEntry) -> Valve:
    if entry.map is None:
        raise BadInput(f"valve[{place}] ({entry.tag}): map", "it is missing", "name a register map")
    own = plant.path(entry.map)
    register_map = RegisterMap.load(own if own.is_file() else entry.map)
    return Valve(entry.tag, register_map if entry.unit is None else register_map.on_unit(entry.unit))


def _valve(
    plant: PlantFile, place: int, entry: ValveEntry, signals: Mapping[str, tuple[SignalSpec, ...]], ends: bool
) -> ValvePlan:
    file = plant.path(entry.model)
    calibrate = tuple(plant.recording(text) for text in entry.calibrate)
    for path in calibrate:
        if not path.is_file():
            raise BadInput(f"valve[{place}] ({entry.tag}): calibrate", f"there is no file {path}", "check the path")
    plan = ValvePlan(entry, ValveModel.read(file), file, signals[entry.tag], calibrate, plant.false_alarms, ends)
    plan.monitor()  # whether the signals can be used
    return plan


def _words(plan: ServicePlan) -> Iterator[str]:
    plant, n = plan.plant, len(plan.valves)
    yield f"{plant.name}: {len(plan.sources)} sources, {n} valves. Nothing was sent; this is what a start would do."
    for source in plan.sources:
        yield from _source_words(source)
    kept = plant.recordings
    yield "recordings: " + (f"{plant.path(kept.folder)}, a new file every {kept.rotate_hours:g} h" if kept else "none")
    yield f"state: {plant.path(plant.state)}"
    mqtt = plant.events.mqtt
    places = [str(plant.path(plant.events.file))] if plant.events.file else []
    places += [f"mqtt://{mqtt.host}:{mqtt.port}/{mqtt.topic}"] if mqtt else []
    yield f"events: {', '.join(places) or 'standard output'}"
    yield f"metrics: {f'http://{plant.metrics.listen}/metrics' if plant.metrics else 'none'}"
    yield f"page: {plant.page.listen if plant.page else 'none'}"


def _source_words(source: SourcePlan) -> Iterator[str]:
    if source.ends:
        yield f"{source.shown}: a recording, played back"
    else:
        requests = sum(len(valve.reads) for valve in source.polled)
        each = source.rate_hz * requests
        how = "readings of the ring" if source.entry.ring else f"rounds of {requests} requests"
        yield f"{source.shown}: {source.rate_hz:g} {how} a second, {each:g} requests a second; it only reads"
    for valve, polled in zip(source.valves, source.polled or [None] * len(source.valves), strict=True):
        names = ", ".join(spec.name for spec in valve.signals if spec.role != "time")
        yield f"  {valve.tag}: {names}"
        for block in polled.map.reads() if polled else ():
            last = block.address + block.count - 1
            yield f"    unit {block.unit_id}, function {block.function_code}, registers {block.address} to {last}"
        learns = "learned from recordings" if valve.calibrate else f"learns for {valve.entry.learn_s:g} s at first"
        yield f"    model {valve.model_file}; {learns}"
