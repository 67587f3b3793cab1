"""A plant whose every value tells its sample number, and ways to serve it, for the tests of the wire."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import asynccontextmanager

import numpy as np
from pymodbus.client import AsyncModbusSerialClient, AsyncModbusTcpClient

from hil import Command, RegisterMap, Server, ServerSettings, WriteMap, listen_address
from recordings import BadInput

SIGNALS = {
    "setpoint": "1",
    "upstream_pressure": "Pa",
    "downstream_pressure": "Pa",
    "temperature": "degC",
    "position": "m",
    "mass_flow": "t/h",
    "pressure": "Pa",
    "drive": "1",
    "supply_pressure": "Pa",
    "flow": "m3/h",
    "plant_time": "s",
}
SPAN = 1 << 20


class Clock:
    """A clock that stands until it is moved."""

    def __init__(self):
        self.now = 100.0

    def __call__(self):
        return self.now


class Ramp:
    """Sample k of every signal is k / 2**20 of its unit (exact in single precision); settings are merely kept."""

    step_s = 0.0025
    units = SIGNALS

    def __init__(self) -> None:
        points = WriteMap.load("damadics-write").points
        own = {"advance", "run", "reset"}
        self.commands = {p.name: Command(p.unit, p.name.startswith("fault")) for p in points if p.name not in own}
        self.settings_now = dict.fromkeys(self.commands, 0.0)
        self.sample = 0

    def signals(self) -> Mapping[str, float]:
        return dict.fromkeys(SIGNALS, self.sample / SPAN)

    def advance(self, n_steps: int) -> Mapping[str, np.ndarray]:
        samples = np.arange(self.sample + 1, self.sample + n_steps + 1) / SPAN
        self.sample += n_steps
        return dict.fromkeys(SIGNALS, samples)

    def settings(self) -> Mapping[str, float]:
        return self.settings_now

    def apply(self, changes: Mapping[str, float]) -> None:
        if changes.get("fault") == 13.0:
            raise BadInput("fault", "13", "anything but 13")
        self.settings_now |= changes

    def reset(self) -> None:
        self.sample = 0


def raw_map(**changes: object) -> RegisterMap:
    """The shipped reading map with every scale 1, so that the wire has the plant's numbers."""
    shipped = RegisterMap.load("damadics").model_dump()
    for point in shipped["points"]:
        point |= {"scale": 1.0, "offset": 0.0, "valid_range": None}
    return RegisterMap.model_validate(shipped | changes)


def settings(*listen: str, **more: object) -> ServerSettings:
    chosen = {"read_map": raw_map(), "write_map": WriteMap.load("damadics-write"), **more}
    return ServerSettings([listen_address(text) for text in listen or ("tcp://127.0.0.1:0",)], **chosen)


def port_of(address: str) -> int:
    return int(address.rsplit(":", 1)[1])


def device_of(address: str) -> str:
    return address.removeprefix("rtu:").split("?")[0]


@asynccontextmanager
async def connected(server: Server, which: int = 0):
    """A plain client of one of the server's addresses."""
    address = server.addresses[which]
    if address.startswith("tcp"):
        client = AsyncModbusTcpClient("127.0.0.1", port=port_of(address), timeout=2, retries=0)
    else:
        client = AsyncModbusSerialClient(device_of(address), timeout=2, retries=0)
    assert await client.connect()
    try:
        yield client
    finally:
        client.close()
