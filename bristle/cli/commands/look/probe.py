"""`bristle probe`: one read of every register of a map."""

from __future__ import annotations

from typing import Annotated

from typer import Argument, Option


def command(
    source: Annotated[
        str, Argument(help="tcp://HOST:PORT, tls://HOST:PORT with ?ca=..&cert=..&key=.., rtu:DEVICE?baud=..")
    ],
    map_: Annotated[str, Option("--map", help="Register map: a file, or a shipped one by name.")],
    unit: Annotated[str | None, Option(help="Device ids of equal valves on one line: 1,2,5-7.")] = None,
    valve: Annotated[str | None, Option(help="Names of the valves, one for each device id: A,B,C.")] = None,
) -> None:
    """Read every register once: raw (hexadecimal), decoded with quality and unit, and under the other byte orders.

    Finds a wrong byte order or address in a minute. Only reads. Exit code 1 when nobody answers or no value is good.

    Example: bristle probe tcp://127.0.0.1:5020 --map damadics
    """
    import asyncio

    from bristle.cli.output.manner import answer, say, stdout
    from bristle.cli.output.working import working
    from bristle.cli.shown.device import probe_facts, probe_table
    from bristle.cli.sources import valves_from
    from hil import live_address, probe
    from recordings import NegativeAnswer

    address, valves = live_address(source), valves_from(map_, unit, valve)
    with working("reading"):
        found = asyncio.run(probe(address, valves))
    answer(probe_facts(source, map_, found))
    console = stdout()
    for one in found:
        console.print(probe_table(one), soft_wrap=False)
        say(*(f"{one.valve}: {sentence}" for sentence in one.advice))
    if not any(one.good for one in found):
        raise NegativeAnswer("not one value is good; check the map, the byte order and the device id")
