"""A simulated valve for tests in Python: served while a `with` block lasts, with its time in the test's hands."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from hil.plant.actuator import ActuatorPlant
from hil.registers.register_map import RegisterMap, WriteMap
from hil.running import LoopThread
from hil.server.server import ServerSettings
from hil.testing.bench.bench import Bench
from hil.testing.bench.device import Device
from recordings import Event, Recording, drawn, save_text, write
from simulator.damadics import Fault

SignalCondition = Callable[[Mapping[str, float]], bool]
"""What is waited for: given the signals of the valve, whether it is so."""


class NotReached(AssertionError):
    """What a test waited for did not happen. The message has the plant time and the last values."""


class SimulatedValve:
    """One simulated actuator behind one address, in a thread of its own. Context manager.

    Parameters
    ----------
    plant : ActuatorPlant
        The actuator.
    settings : ServerSettings
        One address to listen on, the maps, and the speed: None for lock-step, where time moves by `advance` alone.
    name : str, optional
        What to call it, in reports and file names.

    >>> from hil import ActuatorPlant, ActuatorSetup, RegisterMap, ServerSettings, listen_address
    >>> about = ServerSettings([listen_address("tcp://127.0.0.1:0")], RegisterMap.load("damadics"), speed=None)
    >>> with SimulatedValve(ActuatorPlant(ActuatorSetup()), about) as valve:
    ...     valve.advance(2.0)
    ...     round(valve.now["plant_time"], 6)
    2.0
    """

    def __init__(self, plant: ActuatorPlant, settings: ServerSettings, name: str = "valve") -> None:
        self.name = name
        self._bench = Bench({1: plant}, settings)

    def __enter__(self) -> Self:
        self._thread = LoopThread.entered(f"bristle {self.name}", self._bench.__aenter__())
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        try:
            self._thread.run(self._bench.__aexit__(None, None, None))
        finally:
            self._thread.close()

    @property
    def endpoint(self) -> str:
        """Where the program under test finds the valve: ``tcp://127.0.0.1:40123`` or ``rtu:/dev/pts/3?parity=N``."""
        return self._bench.addresses[0]

    @property
    def host(self) -> str:
        """The host of a TCP endpoint."""
        return self.endpoint.partition("://")[2].rpartition(":")[0]

    @property
    def port(self) -> int:
        """The port of a TCP endpoint."""
        return int(self.endpoint.rpartition(":")[2])

    @property
    def device(self) -> str:
        """The terminal of a serial endpoint."""
        return self.endpoint.removeprefix("rtu:").partition("?")[0]

    @property
    def register_map(self) -> RegisterMap:
        """What can be read, and where."""
        return self._bench.settings.read_map

    @property
    def write_map(self) -> WriteMap | None:
        """What can be written, and where."""
        return self._bench.settings.write_map

    @property
    def now(self) -> Mapping[str, float]:
        """What the transmitters show now, whatever is on the line, and ``plant_time`` [s]."""
        return self._do(self._bench.signals)

    def connect(self, timeout: float | None = None) -> Device:
        """A plain client of the valve, over its line; `timeout` for a reply [s]. Use it in a `with` block."""
        told = [] if timeout is None else [f"timeout={timeout:g}"]
        told += [] if self.endpoint.startswith("tcp") else ["quiet=0.05"]  # a simulated line has no late replies
        joint = "&" if "?" in self.endpoint else "?"
        return Device(f"{self.endpoint}{joint if told else ''}{'&'.join(told)}", self.register_map, self.write_map)

    def advance(self, seconds: float) -> None:
        """Let that much plant time go by [s], as fast as the machine can; with a speed, wait until it has."""
        self._thread.run(self._bench.advance(seconds))

    def wait_until(self, condition: SignalCondition, within: float = 60.0, every: float = 0.01) -> float:
        """Let time go by until a condition on the signals is true; returns the plant time then [s].

        condition : called with `now`; within : longest plant time to wait [s]; every : how often to look [s].
        Raises NotReached, an AssertionError, when it did not become true.

        ``valve.wait_until(lambda now: now["position"] > 0.02, within=10.0)``
        """
        end = self.now["plant_time"] + within
        while not condition(now := self.now):
            if now["plant_time"] >= end - 1e-9:
                values = ", ".join(f"{name} = {value:.6g}" for name, value in now.items())
                raise NotReached(f"{self.name}: not within {within:g} s of plant time; at last {values}")
            self.advance(min(every, max(end - now["plant_time"], every / 100)))
        return now["plant_time"]

    def inject(self, fault: int | str, strength: float = 1.0, at: float | None = None, **how: Any) -> Fault:
        """Let a fault of the benchmark happen, `at` a plant time [s] or now; see `Bench.inject`.

        With friction as a force (``friction="lugre"``), ``inject(4)`` makes the valve stick and slip.
        """
        return self._do(lambda: self._bench.inject(fault, strength, at, **how))

    def order(self, name: str, value: float, at: float | None = None) -> None:
        """Change a setting, ``order("lugre.fs", 400.0)``, now or at a plant time [s]; see `Bench.order`."""
        self._do(lambda: self._bench.order({name: value}, at))

    def harm(self, kind: str, share: float = 1.0, **how: float) -> None:
        """Harm the line until `heal`: ``lost``, ``drop``, ``delay``, ``garbage`` and so on; see `Bench.harm`."""
        self._do(lambda: self._bench.harm(kind, share, **how))

    def heal(self) -> None:
        """Let everything pass over the line again."""
        self._do(self._bench.heal)

    def recording(self) -> Recording:
        """Every sample since the start or the last reset, and the events. Raises BadInput when time has not moved."""
        return self._do(self._bench.recording)

    def events(self) -> tuple[Event, ...]:
        """What happened to the valve and its line so far: faults, orders, harm; in plant time."""
        return self._do(self._bench.events)

    def save(self, folder: Path, stem: str | None = None) -> tuple[Path, Path]:
        """Write the recording and its picture to a folder; returns both paths, ``.h5`` and ``.svg``."""
        recording, stem = self.recording(), stem or self.name
        data, picture = folder / f"{stem}.h5", folder / f"{stem}.svg"
        folder.mkdir(parents=True, exist_ok=True)
        write(data, recording, overwrite=True)
        save_text(picture, drawn(recording))
        return data, picture

    def _do(self, work: Callable[[], Any]) -> Any:
        """Something done in the thread of the valve, between two requests."""

        async def done() -> Any:
            return work()

        return self._thread.run(done())
