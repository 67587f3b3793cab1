"""What the control port can be asked for, one model a request, each with what it does; anything else is refused."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, TypeAdapter

from hil.testing.bench.bench import Bench
from recordings import drawn, save_text, write

FiniteNumber = Annotated[float, Field(allow_inf_nan=False)]
UnitId = Annotated[int, Field(ge=1, le=247, strict=True)]


class _Request(BaseModel):
    """A request. unit : of the valve that is meant, and whose signals are the answer where there is no other."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    unit: UnitId = 1

    async def carry_out(self, bench: Bench) -> Mapping[str, Any]:
        """Do it, and return what is to be told. Raises BadInput."""
        return {"unit": self.unit, "signals": dict(bench.signals(self.unit))}


class Hello(_Request):
    """The first request of a connection."""

    do: Literal["hello"]
    token: str


class Advance(_Request):
    """Let plant time go by [s], for every valve."""

    do: Literal["advance"]
    seconds: FiniteNumber

    async def carry_out(self, bench: Bench) -> Mapping[str, Any]:
        """Answers when it has gone by."""
        await bench.advance(self.seconds)
        return await super().carry_out(bench)


class Inject(_Request):
    """A fault of the benchmark, by number or name; at, develop, until in plant time [s]."""

    do: Literal["inject"]
    fault: int | str
    strength: FiniteNumber = 1.0
    at: FiniteNumber | None = None
    develop: FiniteNumber = 0.0
    until: FiniteNumber | None = None
    direction: Literal[-1, 1] | None = None

    async def carry_out(self, bench: Bench) -> Mapping[str, Any]:
        """As `Bench.inject`."""
        until = math.inf if self.until is None else self.until
        how = {"develop": self.develop, "until": until}
        bench.inject(self.fault, self.strength, self.at, **how, direction=self.direction, unit=self.unit)
        return await super().carry_out(bench)


class OrderRequest(_Request):
    """Settings of a valve, now or at a plant time [s]."""

    do: Literal["order"]
    set: dict[str, FiniteNumber]
    at: FiniteNumber | None = None

    async def carry_out(self, bench: Bench) -> Mapping[str, Any]:
        """As `Bench.order`."""
        bench.order(self.set, self.at, unit=self.unit)
        return await super().carry_out(bench)


class Harm(_Request):
    """Harm of the lines: kind, share of the replies, and times by name."""

    do: Literal["harm"]
    kind: str
    share: FiniteNumber = 1.0
    how: dict[str, FiniteNumber] = {}

    async def carry_out(self, bench: Bench) -> Mapping[str, Any]:
        """As `Bench.harm`."""
        bench.harm(self.kind, self.share, **self.how)
        return await super().carry_out(bench)


class Heal(_Request):
    """Sound lines again."""

    do: Literal["heal"]

    async def carry_out(self, bench: Bench) -> Mapping[str, Any]:
        """As `Bench.heal`."""
        bench.heal()
        return await super().carry_out(bench)


class TellSignals(_Request):
    """The signals of a valve now."""

    do: Literal["signals"]


class TellEvents(_Request):
    """What happened to a valve."""

    do: Literal["events"]

    async def carry_out(self, bench: Bench) -> Mapping[str, Any]:
        """Time [s], kind and text of each."""
        events = bench.events(self.unit)
        return {"events": [{"time": one.time, "kind": one.kind, "text": one.text} for one in events]}


class Save(_Request):
    """The recording of a valve, into a file of the server's machine: .h5, or .svg for a picture."""

    do: Literal["recording"]
    to: Annotated[str, Field(min_length=1, max_length=4096)]

    async def carry_out(self, bench: Bench) -> Mapping[str, Any]:
        """Answers when the file is there."""
        recording, path = bench.recording(self.unit), Path(self.to)
        if path.suffix == ".svg":
            save_text(path, drawn(recording))
        else:
            write(path, recording)
        return {"to": str(path.resolve()), "samples": len(recording)}


class End(_Request):
    """The end of the server."""

    do: Literal["stop"]


ControlRequest = Hello | Advance | Inject | OrderRequest | Harm | Heal | TellSignals | TellEvents | Save | End

_READER: TypeAdapter[ControlRequest] = TypeAdapter(Annotated[ControlRequest, Field(discriminator="do")])


def of_line(line: bytes) -> ControlRequest:
    """The request of one line of JSON. Raises ValidationError."""
    return _READER.validate_json(line)
