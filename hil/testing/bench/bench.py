"""Simulated valves behind Modbus whose time, faults and lines are in the hands of a test."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Mapping
from contextlib import AsyncExitStack
from dataclasses import replace
from types import TracebackType
from typing import Self

from hil.plant.actuator import ActuatorPlant
from hil.server.server import Server, ServerSettings
from hil.server.unit import MOST_AT_ONCE
from hil.testing.bench.harmed_line import LOST, HarmedLine, injector, inner
from hil.testing.bench.recorded_plant import RecordedPlant
from recordings import BadParameter, Event, Plant, Recording
from simulator.damadics import FAULTS, Fault

LONGEST_S = 1e6
"""The longest time that is simulated at one word [s]."""

LOOK_S = 0.005
"""How often plant time that follows a clock is looked at [s]."""


class Bench:
    """Serves simulated actuators by unit id, and does to them and to their lines what a test wants.

    Every sample is remembered. In front of every listener on ``tcp://127.0.0.1`` and ``pty:`` stands a fault injector.
    Asynchronous context manager; entering raises BadInput as `Server` does.

    Parameters
    ----------
    plants : mapping
        The actuators by unit id, 1 to 247.
    settings : ServerSettings
        Where they are served and how; with the speed None (lock-step) time moves by `advance` alone.
    """

    def __init__(self, plants: Mapping[int, ActuatorPlant], settings: ServerSettings) -> None:
        self.settings = settings
        self._plants = dict(plants)
        self._recorded = {unit: RecordedPlant(plant, _about(plant)) for unit, plant in plants.items()}
        self._faults: dict[int, tuple[Fault, ...]] = {unit: plant.setup.faults for unit, plant in plants.items()}
        self.server = Server(self._recorded, replace(settings, listen=[inner(one) for one in settings.listen]))
        self._lines: list[HarmedLine] = []

    async def __aenter__(self) -> Self:
        self._open = AsyncExitStack()
        async with AsyncExitStack() as opening:
            await opening.enter_async_context(self.server)
            for address, served in zip(self.settings.listen, self.server.addresses, strict=True):
                between = injector(address, served)
                if between is not None:
                    await opening.enter_async_context(between)
                self._lines.append(HarmedLine.of(served, between))
            self._open = opening.pop_all()
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None
    ) -> None:
        await self._open.aclose()

    @property
    def addresses(self) -> list[str]:
        """Where clients find the valves, one per listener."""
        return [line.address for line in self._lines]

    @property
    def lock_step(self) -> bool:
        """Whether time moves by `advance` alone."""
        return self.settings.speed is None

    def signals(self, unit: int = 1) -> Mapping[str, float]:
        """What the transmitters of a valve show now, in the units of the plant, and ``plant_time`` [s]."""
        return self._of(unit).signals()

    async def advance(self, seconds: float) -> None:
        """Let that much plant time go by for every valve [s]: at once in lock-step, else by waiting for it.

        Raises BadParameter for a time that cannot go by.
        """
        if not (math.isfinite(seconds) and 0.0 <= seconds <= LONGEST_S):
            raise BadParameter("seconds", f"{seconds:g}", "so much time cannot go by", f"0 to {LONGEST_S:g} s")
        ends = {unit: self._goal(unit, seconds) for unit in self._recorded}
        for unit, end in ends.items():
            served = self.server.units[unit]
            while (left := end - served.samples) > 0:
                if self.lock_step:
                    served.advance(min(left, MOST_AT_ONCE))
                await asyncio.sleep(0.0 if self.lock_step else LOOK_S)

    def inject(
        self,
        fault: int | str,
        strength: float = 1.0,
        at: float | None = None,
        *,
        develop: float = 0.0,
        until: float = math.inf,
        direction: int | None = None,
        unit: int = 1,
    ) -> Fault:
        """Let a fault of the benchmark happen to a valve, on top of those that are there.

        Parameters
        ----------
        fault : int or str
            Its number, 1 to 19, or ``"f4"``, or its name as the benchmark has it: ``"friction of valve or bushing"``.
        strength : float, optional
            0 to 1, the final one.
        at : float, optional
            From when on, in plant time [s]; now when not given.
        develop, until : float, optional
            How long it takes to grow, and when it is gone [s].
        direction : {1, -1}, optional
            The benchmark's when not given.
        unit : int, optional
            Which valve.

        Raises
        ------
        BadInput
            There is no such fault, or it cannot be that strong.
        """
        plant, now = self._of(unit), self._of(unit).time_s
        wanted = Fault(_number(fault), strength, now if at is None else at, develop, until, direction)
        self._plants[unit].inject(wanted)
        self._faults[unit] = (*self._faults[unit], wanted)
        plant.note("injected", f"f{wanted.number}, from {wanted.start_s:g} s on")
        return wanted

    def order(self, changes: Mapping[str, float], at: float | None = None, *, unit: int = 1) -> None:
        """Change settings of a valve, now or at a plant time [s]: ``{"setpoint": 0.3}``, ``{"lugre.fs": 400.0}``.

        No client is asked for it, and it does not go over the line. Raises BadParameter for a setting that is not
        there, BadInput for a value that cannot be (at its time, where it is ordered for later).
        """
        plant = self._of(unit)
        for name in changes:
            if name not in plant.commands:
                raise BadParameter("order", name, "there is no such setting", f"there are {', '.join(plant.commands)}")
        plant.order(changes, -math.inf if at is None else at)

    def harm(self, kind: str, share: float = 1.0, **how: float) -> None:
        """Harm the lines to the valves until `heal`, in the place of what harmed them before.

        kind : one of `HARMS`: a fault of replies, or ``lost``, a cut line over which nothing passes. share : of the
        replies that it befalls, 0 to 1. how : ``delay_s``, ``jitter_s``, ``drip_s``, ``silence`` and ``seed`` of
        `FaultSchedule`. Raises BadParameter.
        """
        for line in self._lines:
            line.harm(kind, share, how)
        for plant in self._recorded.values():
            plant.note("harm", kind if kind == LOST else f"{kind}, {100 * share:g} % of the replies")

    def heal(self) -> None:
        """Let everything pass over the lines again. Faults of the valves stay."""
        for line in self._lines:
            line.heal()
        for plant in self._recorded.values():
            plant.note("heal", "the lines are sound again")

    def events(self, unit: int = 1) -> tuple[Event, ...]:
        """What happened to a valve and its line until now, in the order of plant time: faults, orders, harm."""
        now = self._of(unit).time_s
        happened = [*self._of(unit).events, *(event for fault in self._faults[unit] for event in _told(fault))]
        return tuple(sorted((event for event in happened if event.time <= now), key=lambda event: event.time))

    def recording(self, unit: int = 1) -> Recording:
        """All samples of a valve since its start or last reset, with events, whatever clients have seen of them.

        Raises BadInput while there are less than two.
        """
        return self._of(unit).recording(f"simulated valve {unit}", self.events(unit))

    def _of(self, unit: int) -> RecordedPlant:
        if unit not in self._recorded:
            there = ", ".join(map(str, self._recorded))
            raise BadParameter("unit", unit, "there is no such valve", f"there are {there}")
        return self._recorded[unit]

    def _goal(self, unit: int, seconds: float) -> int:
        """Number of the sample up to which time is to go on."""
        return self.server.units[unit].samples + round(seconds / self._recorded[unit].step_s)


def _number(fault: int | str) -> int:
    """The number of a fault by number, ``f4`` or name. Raises BadParameter."""
    names = {kind.name: number for number, kind in FAULTS.items()}
    if isinstance(fault, str) and fault in names:
        return names[fault]
    text = str(fault).removeprefix("f")
    if not (text.isdecimal() and int(text) in FAULTS):
        told = ", ".join(f"f{number} {name}" for name, number in names.items())
        raise BadParameter("fault", fault, "there is no such fault", f"there are {told}")
    return int(text)


def _about(plant: ActuatorPlant) -> Plant:
    p = plant.setup.parameters
    return Plant(p.mass, p.stroke, p.diaphragm_area, p.spring_rate, p.preload)


def _told(fault: Fault) -> list[Event]:
    """The events of a fault: when it begins, and when it is gone."""
    name = f"f{fault.number} {fault.kind.name}"
    manner = f"over {fault.development_s:g} s" if fault.development_s else "at once"
    onset = Event(fault.start_s, "fault", f"{name}: {fault.sign * fault.strength:+g}, {manner}")
    return [onset, *([Event(fault.stop_s, "fault_end", f"{name}: gone")] if math.isfinite(fault.stop_s) else [])]
