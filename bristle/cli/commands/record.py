"""`bristle record`: a live source into recordings."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from hil import RecorderEnd, RecorderReport, RegisterMap


def command(
    source: Annotated[
        str,
        typer.Option(
            help="tcp://HOST:PORT, tls://HOST:PORT with ?ca=..&cert=..&key=.., rtu:DEVICE?baud=.., replay:REC"
        ),
    ],
    to: Annotated[Path, typer.Option(help="Directory, or a new file ending in .h5 for one valve.")],
    map_: Annotated[str | None, typer.Option("--map", help="Register map: a file, or a shipped one by name.")] = None,
    rate: Annotated[
        float, typer.Option(help="Polls per second (with --ring: readings of the ring).", min=1e-4, max=1e4)
    ] = 10.0,
    duration: Annotated[float | None, typer.Option(help="Stop after so many seconds.", min=0.0, max=1e9)] = None,
    unit: Annotated[str | None, typer.Option(help="Device ids of equal valves on one line: 1,2,5-7.")] = None,
    valve: Annotated[str | None, typer.Option(help="Names of the valves, one for each device id: A,B,C.")] = None,
    ring: Annotated[bool, typer.Option("--ring", help="Fetch every sample that the device keeps in its ring.")] = False,
    heartbeat: Annotated[str | None, typer.Option(help="Point that must change, instead of the map's own.")] = None,
    heartbeat_s: Annotated[float, typer.Option(help="How many seconds it may stand still.", min=1e-3, max=1e6)] = 2.0,
    rotate_mb: Annotated[float | None, typer.Option(help="Begin a new file at so many MB.", min=0.01, max=1e6)] = None,
    rotate_minutes: Annotated[
        float | None, typer.Option(help="Begin a new file after so many minutes.", min=1e-3, max=1e6)
    ] = None,
    batch: Annotated[
        float, typer.Option(help="How many seconds samples may wait for the disk.", min=0.01, max=60.0)
    ] = 0.5,
    plant: Annotated[list[str] | None, typer.Option(help="What is known of the plant: stroke_m=0.0381, ...")] = None,
    title: Annotated[str | None, typer.Option(help="One line for plots and reports.")] = None,
    acknowledge: Annotated[bool, typer.Option("--acknowledge", help="Print FILE SAMPLES once they are safe.")] = False,
) -> None:
    """Record live values into crash-safe recordings until --duration is over, or Ctrl-C or SIGTERM comes.

    Values that are not good are missing (NaN) and an event says why. Nothing is ever written to the plant.

    Example: bristle record --source tcp://127.0.0.1:5020 --map damadics --to runs/ --rate 10 --duration 60
    """
    import asyncio

    from bristle.cli.import_options import plant_from
    from bristle.cli.output.live import Latest, LiveLine
    from bristle.cli.output.manner import answer, manner, note, say
    from bristle.cli.sources import located, valves_from
    from hil import Polling, PollingStopped, RecorderSettings, RingReading, open_source, record_session
    from recordings import BadInput, NegativeAnswer

    line = LiveLine()
    if acknowledge and manner().json:
        raise BadInput("--acknowledge", "it prints lines, and --json one object", "give one of the two")
    settings = RecorderSettings(
        to=to,
        rotate_mb=rotate_mb,
        rotate_s=None if rotate_minutes is None else 60.0 * rotate_minutes,
        batch_s=batch,
        title=title,
        plant=plant_from(plant or ()),
        acknowledge=_acknowledge if acknowledge else None,
        tell=lambda event: line.say(f"{event.valve}: {event.kind}: {event.text}"),
    )
    plan = RingReading(rate) if ring else Polling(rate, heartbeat, heartbeat_s)
    valves = valves_from(map_, unit, valve) if map_ else ()
    live = Latest(open_source(located(source), valves, plan, name=valve))
    settings.check(list(live.signals))
    if valves and not ring:
        note(*_untold(source, valves[0].map, heartbeat))

    def show(report: RecorderReport, seconds: float) -> None:
        line.update(seconds, f"{_progress(report, seconds)}  {live.words()}")

    try:
        end = asyncio.run(record_session(live, settings, duration, show))
    except PollingStopped as stopped:
        raise NegativeAnswer(f"{stopped}; what was recorded until then is in {to}") from stopped
    finally:
        line.end()
    answer(_result(end))
    say(_summary(end.report))
    if end.interrupted:
        raise KeyboardInterrupt
    if not end.report.samples:
        raise NegativeAnswer(f"{source}: no sample came in {end.seconds:.1f} s, nothing was recorded")


def _untold(source: str, read: RegisterMap, heartbeat: str | None) -> Iterator[str]:
    """What could go wrong with a map on which the protocol itself could not tell it."""
    if not (heartbeat or read.heartbeat):
        yield "the map names no heartbeat: a value that stands still, or is an earlier one, cannot be told"
    alike = read.look_alikes()
    if source.startswith("rtu:") and alike:
        places = ", ".join(f"{block.table} {block.address}" for block in alike[:4]) + (", ..." if alike[4:] else "")
        yield (
            f"replies to the reads from {places} have one form: on a serial line one in the place of another cannot be "
            "told; let each read another number of registers"
        )


def _acknowledge(path: Path, n_samples: int) -> None:
    with suppress(BrokenPipeError):  # whoever listened has gone; the recording goes on
        print(path, n_samples, flush=True)


def _progress(report: RecorderReport, seconds: float) -> str:
    missed = report.statistics.missed
    counts = {"deadlines missed": missed, "failures": report.statistics.failures.total()}
    troubles = "".join(f"  {n} {what}" for what, n in counts.items() if n)
    return f"{report.samples} samples  {report.samples / max(seconds, 1e-9):.1f} Hz{troubles}"


def _result(end: RecorderEnd) -> dict[str, Any]:
    statistics = end.report.statistics
    valves = [
        {"valve": one.valve, "files": list(one.files), "samples": one.samples, "not_good": one.bad, "rate_hz": one.rate}
        for one in end.report.valves
    ]
    late = {f"p{round(100 * q)}": statistics.lateness.quantile(q) for q in (0.5, 0.99)}
    return {
        "valves": valves, "seconds": end.seconds, "interrupted": end.interrupted, "missed_deadlines": statistics.missed,
        "lateness_s": late | {"max": statistics.lateness.maximum}, "refused": dict(statistics.faults),
        "failures": dict(statistics.failures),
    }  # fmt: skip


def _summary(report: RecorderReport) -> str:
    lines = []
    for one in report.valves:
        about = f"{one.samples} samples, {one.rate:.2f} Hz, {one.bad} with a value that is not good"
        lines += [f"{one.valve}: {about}", *(f"  {path}" for path in one.files)]
    statistics = report.statistics
    late = " ".join(f"{word} {1e3 * statistics.lateness.quantile(q):.2f}" for word, q in (("p50", 0.5), ("p99", 0.99)))
    longest = 1e3 * statistics.lateness.maximum
    deadlines = f"{statistics.missed} of {statistics.polls + statistics.missed} deadlines missed"
    lines.append(f"lateness [ms]: {late} max {longest:.2f}; {deadlines}")
    if statistics.failures:
        lines.append("failures: " + ", ".join(f"{n} x {failure}" for failure, n in statistics.failures.most_common()))
    if statistics.faults:
        lines.append("refused: " + ", ".join(f"{n} x {fault}" for fault, n in statistics.faults.most_common()))
    return "\n".join(lines)
