"""`bristle monitor`: live detection."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Annotated

from typer import Argument, Context, Option

PLANT_FILE, OF_PLANT_FILES = ("plant_file", "plant", "check"), ("metrics", "on_event")
OF_BOTH = ("duration", "page", "expose", "page_token", "page_cert", "page_key")


def _refuse(context: Context, names: Iterable[str], remedy: str) -> None:
    """Raise BadInput for the first of these options that was given: one that is not heard must not pass for heard."""
    from bristle.cli.output.parameters import option
    from recordings import BadInput

    for name in names:
        source = context.get_parameter_source(name)
        if source is not None and source.name == "COMMANDLINE":
            raise BadInput(option(name.rstrip("_")), "it does nothing here", remedy)


def command(
    context: Context,
    plant_file: Annotated[Path | None, Argument(help="Plant file (TOML): many valves, as a service.")] = None,
    plant: Annotated[Path | None, Option(help="The same as an option.")] = None,
    check: Annotated[bool, Option("--check", help="Only say what a plant file would do; nothing is sent.")] = False,
    metrics: Annotated[
        str | None, Option(help="With a plant file: where Prometheus asks, HOST:PORT, instead of the file's.")
    ] = None,
    on_event: Annotated[
        Path | None, Option(help="With a plant file: program to run for every event, its line on standard input.")
    ] = None,
    source: Annotated[
        str | None,
        Option(help="tcp://HOST:PORT, tls://HOST:PORT with ?ca=..&cert=..&key=.., rtu:DEVICE?baud=.., replay:REC"),
    ] = None,
    model: Annotated[Path | None, Option(help="Model of the valve, from bristle fit or trace.")] = None,
    map_: Annotated[str | None, Option("--map", help="Register map: a file, or a shipped one by name.")] = None,
    rate: Annotated[
        float, Option(help="Polls per second (with --ring: readings of the ring).", min=1e-4, max=1e4)
    ] = 10.0,
    learn: Annotated[
        float | None, Option(help="Learn from so many seconds, or more until the valve has moved.", min=1.0, max=1e9)
    ] = None,
    calibrate: Annotated[list[str] | None, Option(help="Learn from this healthy recording (repeat).")] = None,
    state: Annotated[Path | None, Option(help="What was learned; MODEL.state.json otherwise.")] = None,
    false_alarms: Annotated[float, Option(help="Allowed false alarms a month.", min=1e-3, max=1e4)] = 1.0,
    events: Annotated[Path | None, Option(help="Append events to this file instead of printing them.")] = None,
    record: Annotated[Path | None, Option(help="Record everything into this directory.")] = None,
    duration: Annotated[float | None, Option(help="Stop after so many seconds.", min=0.0, max=1e9)] = None,
    unit: Annotated[str | None, Option(help="Device ids of equal valves on one line: 1,2,5-7.")] = None,
    valve: Annotated[str | None, Option(help="Names of the valves, one for each device id: A,B,C.")] = None,
    ring: Annotated[bool, Option("--ring", help="Fetch every sample that the device keeps in its ring.")] = False,
    report: Annotated[Path | None, Option(help="Write a self-contained HTML page here at the end.")] = None,
    page: Annotated[str | None, Option(help="Show a live page: [HOST:]PORT; 0 for any free port.")] = None,
    expose: Annotated[
        bool, Option("--expose", help="Let other machines look at the page; needs the three below.")
    ] = False,
    page_token: Annotated[Path | None, Option(help="File with the secret that who looks has to know.")] = None,
    page_cert: Annotated[Path | None, Option(help="Certificate of the page (PEM).")] = None,
    page_key: Annotated[Path | None, Option(help="Private key of that certificate (PEM).")] = None,
) -> None:
    """Watch valves until --duration is over, or Ctrl-C or SIGTERM comes. Exit code 1 when there was an alarm.

    What is learned is saved, and the next start resumes from it; --learn learns anew. Nothing is written to the plant.

    With a plant file it watches many valves as a service, until it is told to stop: bristle monitor --plant plant.toml

    Example: bristle monitor --map damadics --source tcp://127.0.0.1:5020 --model model.json --learn 300
    """
    from bristle.cli.watching.live_page import page_settings

    settings = page_settings(page, expose, page_token, page_cert, page_key)
    if plant_file or plant or check:
        from bristle.cli.watching.service import plant_service

        others = set(context.params) - {*PLANT_FILE, *OF_PLANT_FILES, *OF_BOTH}
        _refuse(context, sorted(others), "it is for one source; the plant file has keys of its own")
        plant_service(plant_file or plant, check, duration, metrics, on_event, settings)
        return
    _refuse(context, OF_PLANT_FILES, "it is for a plant file: give --plant, too")
    from bristle.cli.sources import located, valves_from
    from bristle.cli.watching import monitoring
    from hil import Polling, RecorderSettings, RingReading, open_source
    from recordings import BadInput

    if source is None or model is None:
        missing = "--source" if source is None else "--model"
        raise BadInput(missing, "it is missing", "give --source and --model for one source, or a plant file for many")
    plan = RingReading(rate) if ring else Polling(rate)
    live = open_source(located(source), valves_from(map_, unit, valve) if map_ else (), plan, name=valve)
    recorded = None if record is None else RecorderSettings(to=record)
    kept = state or model.with_name(f"{model.stem}.state.json")
    options = monitoring.MonitorOptions(
        model, learn, calibrate or (), kept, false_alarms, events, duration, recorded, source.startswith("replay:"),
        settings, source, rate, report,
    )  # fmt: skip
    monitoring.watch(live, options)
