"""How fast, how punctual and how small the source is, and how soon it is back after an outage.

    python -m benchmarks.link                    everything (about eight minutes)
    python -m benchmarks.link --seconds 3        a look

The device is another process that answers from memory and does as little as it can, so that the client is measured:
10 float32 values in one read of 20 registers. The bare client is pymodbus' own, in this process, on the same device;
`registers` takes what it returns and looks no further, `values` also converts the ten numbers, `with silence` leaves
the 3.5 characters between two frames that the serial standard wants and the client does not. The source polls as fast
as it can, with all its checks, and hands samples with ten judged readings to whoever iterates.
"""

from __future__ import annotations

import argparse
import asyncio
import gc
import statistics
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

from pymodbus.client import AsyncModbusSerialClient, AsyncModbusTcpClient

from benchmarks.link_device import Device
from benchmarks.machine import machine
from hil import LinkEvent, Polling, RegisterMap, Sample, Source, open_source, parse_address, valves_of

POINTS = [
    {"name": f"v{k}", "table": "input", "address": 2 * k, "type": "float32", "unit": "1", "valid_range": [0.0, 50.0]}
    for k in range(10)
]
MAP = RegisterMap.model_validate({"name": "bench", "points": POINTS})
GOAL_RATIO, GOAL_RESUME_S, GOAL_SLIP = 0.8, 2.0, 0.01
Client = AsyncModbusTcpClient | AsyncModbusSerialClient


def tcp(device: Device, rate: float | None, units: range = range(1, 2)) -> Source:
    return open_source(f"tcp://127.0.0.1:{device.port}", valves_of(MAP, units), Polling(rate))


def rtu(path: str, baud: int) -> Source:
    return open_source(f"rtu:{path}?baud={baud}&parity=N&quiet=0.05", valves_of(MAP), Polling(None))


class Speed(NamedTuple):
    """Reads per second, and the processor time of each in this process [s]."""

    rate: float
    cost: float


async def source_speed(source: Source, seconds: float) -> Speed:
    """What comes out of a source, the first fifty samples left out: connecting, and getting to know a serial line."""
    n_samples, started, cost = 0, 0.0, 0.0
    async with source:
        async for item in source:
            n_samples += isinstance(item, Sample)
            if n_samples == 50 and not started:
                started, cost = time.perf_counter(), time.process_time()
            if started and time.perf_counter() - started > seconds:
                break
        n_reads = n_samples - 50
        return Speed(n_reads / (time.perf_counter() - started), (time.process_time() - cost) / n_reads)


class Bare(NamedTuple):
    """A use of pymodbus' client: whether it converts the ten numbers, and how long it is silent between reads [s]."""

    name: str
    convert: bool = False
    silence: float = 0.0


REGISTERS, VALUES = Bare("registers"), Bare("values", convert=True)


async def bare_speed(client: Client, seconds: float, use: Bare) -> Speed:
    """What pymodbus' client reads."""
    await asyncio.sleep(0.2)  # what comes of a request that nobody waited for would be its first answer
    await client.connect()
    n_reads, started, cost = 0, time.perf_counter(), time.process_time()
    while time.perf_counter() - started < seconds:
        reply = await client.read_input_registers(0, count=20, device_id=1)
        n_reads += 1
        if use.convert:
            for k in range(10):
                client.convert_from_registers(reply.registers[2 * k : 2 * k + 2], client.DATATYPE.FLOAT32)
        if use.silence:
            await asyncio.sleep(use.silence)
    speed = Speed(n_reads / (time.perf_counter() - started), (time.process_time() - cost) / n_reads)
    client.close()
    return speed


def throughput(device: Device, seconds: float) -> list[str]:
    """Our rate over the bare client's, in turns so that a busy machine is unkind to both."""
    lines = [
        compared(
            "TCP",
            lambda: tcp(device, None),
            lambda: AsyncModbusTcpClient("127.0.0.1", port=device.port, retries=0),
            (REGISTERS, VALUES),
            seconds / 5,
        )
    ]
    for name, path, baud in (("RTU, 19200 Bd", device.slow_path, 19200), ("RTU, no line", device.path, 115200)):

        def client(path: str = path, baud: int = baud) -> Client:
            return AsyncModbusSerialClient(path, baudrate=baud, timeout=1.0, retries=0)

        def source(path: str = path, baud: int = baud) -> Source:
            return rtu(path, baud)

        silent = Bare("with silence", silence=parse_address(f"rtu:{path}?baud={baud}&parity=N").line.gap)
        lines.append(compared(name, source, client, (REGISTERS, silent), seconds / 5))
    return lines


def compared(
    name: str, source: Callable[[], Source], client: Callable[[], Client], uses: Sequence[Bare], seconds: float
) -> str:
    """One line of the table: medians of five turns."""

    async def turn() -> list[Speed]:
        ours = await source_speed(source(), seconds)
        return [ours, *[await bare_speed(client(), seconds, use) for use in uses]]

    turns = [asyncio.run(turn()) for _ in range(5)]
    rates = [statistics.median(one.rate for one in side) for side in zip(*turns, strict=True)]
    costs = [1e6 * statistics.median(one.cost for one in side) for side in zip(*turns, strict=True)]
    ratios = [statistics.median(one[0].rate / one[k].rate for one in turns) for k in range(1, 1 + len(uses))]
    bare = ", ".join(
        f"{use.name} {rate:.0f}/s ratio {ratio:.2f}" for use, rate, ratio in zip(uses, rates[1:], ratios, strict=True)
    )
    processor = ", ".join(f"{cost:.0f}" for cost in costs)
    return f"  {name:13} source {rates[0]:5.0f}/s; bare: {bare} (goal {GOAL_RATIO}); processor us a read: {processor}"


def lateness(device: Device, seconds: float) -> str:
    """How late rounds begin at 100 Hz."""

    async def run() -> Source:
        source = tcp(device, 100.0)
        async with source:
            async for item in source:
                if isinstance(item, Sample) and source.statistics.polls >= 100 * seconds:
                    break
        return source

    late = (told := asyncio.run(run()).statistics).lateness
    p50, p99 = (1e3 * late.quantile(share) for share in (0.5, 0.99))
    about = f"{told.missed} of {told.polls + told.missed} deadlines missed"
    return f"  p50 {p50:.2f} ms   p99 {p99:.2f} ms   max {1e3 * late.maximum:.2f} ms   {about}"


async def until(source: Source, wanted: Callable[[Sample | LinkEvent], bool]) -> float:
    """The moment at which a source says what is wanted."""
    async for item in source:
        if wanted(item):
            return time.perf_counter()
    raise RuntimeError("the source ended")


def resume(device: Device, outages: tuple[float, ...]) -> list[str]:
    """From the moment the device serves again to the first good sample."""

    async def outage(seconds: float) -> tuple[float, float]:
        async with tcp(device, 100.0) as source:
            await until(source, lambda item: isinstance(item, Sample))
            killed = time.perf_counter()
            device.kill()
            noticed = await until(source, lambda item: isinstance(item, LinkEvent) and item.kind == "link_down")
            await asyncio.sleep(seconds)
            await asyncio.to_thread(device.start)
            served = time.perf_counter()
            back = await until(source, lambda item: isinstance(item, Sample) and item.good)
            return noticed - killed, back - served

    lines = []
    for seconds in outages:
        noticed, back = asyncio.run(outage(seconds))
        lines.append(
            f"  outage {seconds:5.1f} s: noticed after {1e3 * noticed:5.1f} ms, "
            f"back {1e3 * back:6.1f} ms after the device (goal {GOAL_RESUME_S:g} s)"
        )
    return lines


def memory(device: Device, polls: int) -> str:
    """What a long run adds to this process."""

    def resident_mb() -> float:
        return int(Path("/proc/self/statm").read_text().split()[1]) * 4096 / 1e6

    async def run() -> tuple[float, float]:
        async with tcp(device, None) as source:
            n_samples, before = 0, 0.0
            async for item in source:
                n_samples += isinstance(item, Sample)
                if n_samples == polls // 10 and not before:
                    before = resident_mb()
                if n_samples >= polls + polls // 10:
                    return before, resident_mb()
        raise RuntimeError("the source ended")

    before, after = asyncio.run(run())
    return f"  {before:.1f} MB after {polls // 10} polls, {after - before:+.1f} MB after {polls} more"


async def slip(sources: list[Source], seconds: float) -> float:
    """The share of deadlines that were missed by sources that run together."""

    async def consume(source: Source) -> None:
        async with source:
            async for _ in source:
                pass

    gc.collect()
    gc.freeze()  # as the recorder does
    tasks = [asyncio.ensure_future(consume(source)) for source in sources]
    await asyncio.sleep(2.0 + len(sources) / 200)  # until all are connected
    before = [(source.statistics.missed, source.statistics.polls) for source in sources]
    await asyncio.sleep(seconds)
    missed = sum(source.statistics.missed - old for source, (old, _) in zip(sources, before, strict=True))
    polls = sum(source.statistics.polls - old for source, (_, old) in zip(sources, before, strict=True))
    for task in tasks:
        task.cancel()
    await asyncio.gather(*tasks, return_exceptions=True)
    gc.unfreeze()
    return missed / (missed + polls)


def capacity(device: Device, seconds: float, sources: Callable[[int], list[Source]], largest: int) -> str:
    """How many valves at 10 Hz fit, in steps of a quarter, before more than 1 % of the deadlines slip."""
    n_valves, fits, tried = 100, 0, list[str]()
    while n_valves <= largest:
        share = min(asyncio.run(slip(sources(n_valves), seconds)) for _ in range(2))  # others use this machine too
        tried.append(f"{n_valves}: {100 * share:.2f} %")
        if share >= GOAL_SLIP:
            break
        fits, n_valves = n_valves, n_valves * 5 // 4
    return f"  {fits} valves   (missed: {', '.join(tried[-4:])})"


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float, default=20.0, help="how long each measurement takes")
    parser.add_argument("--polls", type=int, default=100_000, help="polls of the memory measurement")
    options = parser.parse_args()
    print(machine("pymodbus", "pyserial"))
    device = Device()
    try:
        print("polled reads per second, one after the other", *throughput(device, options.seconds), sep="\n")
        print("lateness at 100 Hz over TCP", lateness(device, options.seconds), sep="\n")
        print("back after an outage", *resume(device, (0.5, options.seconds / 4, options.seconds)), sep="\n")
        print("memory", memory(device, options.polls), sep="\n")
        seconds = options.seconds / 4
        print("valves at 10 Hz in one process, each with a connection of its own")
        print(capacity(device, seconds, lambda n: [tcp(device, 10.0) for _ in range(n)], 2000))
        print("valves at 10 Hz in one process, all behind one connection")
        print(capacity(device, seconds, lambda n: [tcp(device, 10.0, range(1, n + 1))], 247))
    finally:
        device.kill()


if __name__ == "__main__":
    main()
