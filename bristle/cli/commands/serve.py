"""`bristle serve`: the simulated actuator behind Modbus."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from typer import Context, Option


def command(
    context: Context,
    listen: Annotated[
        list[str] | None, Option(help="tcp://127.0.0.1:5020, tls://.., rtu:/dev/ttyS0, pty: (repeat)")
    ] = None,
    plant: Annotated[Path | None, Option(help="What the valve is, a TOML file; options come on top of it.")] = None,
    map_: Annotated[
        str | None, Option("--map", help="Register map: a TOML or CSV file, or a shipped one; damadics otherwise.")
    ] = None,
    write_map: Annotated[
        str | None, Option(help="What may be written: a file, a shipped one, or none; damadics-write otherwise.")
    ] = None,
    units: Annotated[int, Option(help="Valves behind each address, as devices 1 to N.", min=1, max=247)] = 1,
    speed: Annotated[float, Option(help="Times real time.", min=1e-3, max=1e4)] = 1.0,
    lock_step: Annotated[bool, Option("--lock-step", help="Time moves only by the advance register.")] = False,
    scenario: Annotated[str | None, Option(help="Of the benchmark: healthy, f4-incipient, chapter5-f11 ...")] = None,
    friction: Annotated[
        str | None, Option(help="play (the benchmark's, if nothing is said) or lugre (friction as a force).")
    ] = None,
    fault: Annotated[
        list[str] | None,
        Option(help="4:strength=0.5,from=70 (share, s); also until, develop (repeat)"),
    ] = None,
    set_: Annotated[
        list[str] | None, Option("--set", help="setpoint=0.3, gain=40, lugre.fc=200 (SI units; repeat)")
    ] = None,
    effect: Annotated[
        list[str] | None, Option(help="An undeclared one: backlash:width=1e-4 (SI units; repeat)")
    ] = None,
    effect_off: Annotated[bool, Option("--effect-off", help="Effects act once switched on by register.")] = False,
    noise: Annotated[bool, Option("--noise", help="The benchmark's measurement noise.")] = False,
    seed: Annotated[int | None, Option(help="Seed of the noise, 0 otherwise; each unit adds its place.", min=0)] = None,
    allow_faults: Annotated[bool, Option("--allow-faults", help="Faults, friction, effects by register.")] = False,
    expose: Annotated[bool, Option("--expose", help="Listen where other machines can reach it.")] = False,
    cert: Annotated[Path | None, Option(help="Certificate for tls:// (PEM).")] = None,
    key: Annotated[Path | None, Option(help="Its private key (PEM).")] = None,
    ca: Annotated[Path | None, Option(help="Authority that clients must be vouched for by (PEM).")] = None,
    make_test_ca: Annotated[Path | None, Option(help="Only write certificates for tests to this folder.")] = None,
    control: Annotated[
        int | None, Option(help="Offer a control port on loopback, 0 for any free one.", min=0, max=65535)
    ] = None,
    background: Annotated[
        bool, Option("--background", help="Serve on in the background, with a control port, for 3600 s at most.")
    ] = False,
    duration: Annotated[float | None, Option(help="Stop after so many seconds.", min=0.0, max=1e9)] = None,
) -> None:
    """Put the simulated actuator behind Modbus TCP, RTU or TLS, until --duration is over, or Ctrl-C or SIGTERM comes.

    Prints one line of JSON when it listens and one, with its lateness, at the end. With --background it ends after
    the first line, and the server goes on until its control port says stop or its duration is over.

    Example: bristle serve --listen tcp://127.0.0.1:0 --listen pty: --friction lugre --fault 4:strength=0.5,from=70
    """
    from bristle.cli import serving

    if background:
        serving.detach(context.find_root().obj, duration)
        return
    from bristle.cli.plant_options import ActuatorOptions
    from bristle.door.plant_file import SimulatedPlantFile
    from hil import RegisterMap, ServerSettings, WriteMap, listen_address

    if make_test_ca is not None:
        serving.make_certificates(make_test_ca)
        return
    base = SimulatedPlantFile() if plant is None else SimulatedPlantFile.load(plant)
    writable = write_map or base.write_map
    addresses = [listen_address(text) for text in listen or ["tcp://127.0.0.1:5020"]]
    settings = ServerSettings(
        addresses,
        RegisterMap.load(map_ or base.map),
        None if writable == "none" else WriteMap.load(writable),
        None if lock_step else speed,
        expose,
        allow_faults,
        serving.certificates(addresses, cert, key, ca),
    )
    options = ActuatorOptions(
        scenario, friction, fault or (), set_ or (), effect or (), not effect_off, noise, seed, base
    )
    serving.run({unit: options.plant(unit - 1) for unit in range(1, units + 1)}, settings, duration, control)
