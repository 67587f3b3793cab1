"""Live valves: `bristle record` and `bristle serve` as context managers for synchronous programs."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path

from bristle.door.plants import EffectSizes, actuator
from hil import (
    BackgroundRecorder,
    BackgroundServer,
    Certificates,
    LinkEvent,
    Polling,
    RecorderSettings,
    RegisterMap,
    RingReading,
    ServerSettings,
    WriteMap,
    listen_address,
    open_source,
    valves_of,
)
from recordings import Plant
from simulator import CATALOGUE, Catalogue
from simulator.damadics import Fault, Stimulus


def serve(
    *,
    listen: str | Sequence[str] = "tcp://127.0.0.1:0",
    map: str = "damadics",
    write_map: str | None = "damadics-write",
    units: int = 1,
    speed: float | None = 1.0,
    scenario: str | None = None,
    stimulus: Stimulus | None = None,
    friction: str = "play",
    faults: Iterable[Fault] = (),
    settings: Mapping[str, float] | None = None,
    effects: EffectSizes | None = None,
    catalogue: Catalogue = CATALOGUE,
    noise: bool = False,
    seed: int = 0,
    allow_faults: bool = False,
    expose: bool = False,
    certificates: Certificates | None = None,
) -> BackgroundServer:
    """Serve simulated actuators behind Modbus while a `with` block lasts.

    Parameters
    ----------
    listen : str or several, optional
        ``tcp://127.0.0.1:0`` (any free port), ``tls://127.0.0.1:0``, ``rtu:/dev/ttyS0``, ``pty:``.
    map, write_map : str, optional
        Register maps: a file, or a shipped one by name. Without a write map nothing can be written.
    units : int, optional
        Number of valves, as devices 1 to N. The seed of each is one more than that before.
    speed : float, optional
        Times real time; None for lock-step.
    scenario : str, optional
        Of the benchmark: ``healthy``, ``f4-incipient`` ... Without one, the set point is constant.
    stimulus : callable, optional
        What the process does, instead of the scenario's: from times (n,) [s] to columns (n, 5): share of closing that
        is asked for, pressures before and behind the valve [Pa], temperature [degC], supply pressure [Pa, relative].
    friction : {"play", "lugre"}, optional
        That of the benchmark, or friction as a force.
    faults : sequence of Fault, optional
        What happens to the valve, in plant time.
    settings : mapping, optional
        Inputs and parameters: ``{"setpoint": 0.3, "lugre.fc": 200, "gain": 40}``.
    effects : mapping, optional
        Further effects of the catalogue that the valve has, with sizes: ``{"backlash": {"width": 1e-4}}``.
    catalogue : Catalogue, optional
        Where effects are looked up; ``CATALOGUE.extended`` adds your own.
    noise, seed : bool, int, optional
        Whether there is the benchmark's measurement noise, and its seed.
    allow_faults : bool, optional
        Whether faults, friction and effects can be changed by register.
    expose : bool, optional
        Whether the server may listen where other machines can reach it. TCP has neither passwords nor encryption.
    certificates : hil.Certificates, optional
        What TLS needs: PEM files of the server's certificate and key, and of the authority of its clients.
        `hil.testing.make_loopback_authority` makes some for tests.

    Returns
    -------
    BackgroundServer
        A context manager; ``address`` is where clients find it.

    Raises
    ------
    BadInput
        A name or a value cannot be used, or an address.

    >>> import bristle as br
    >>> with br.serve(settings={"setpoint": 0.3}) as served:
    ...     served.address.startswith("tcp://127.0.0.1:")
    True
    """
    addresses = [listen] if isinstance(listen, str) else listen
    plants = {
        unit: actuator(
            scenario, friction, faults, settings or {}, effects or {}, stimulus=stimulus,
            catalogue=catalogue, noise=noise, seed=seed + unit - 1,
        )
        for unit in range(1, units + 1)
    }  # fmt: skip
    writable = None if write_map is None else WriteMap.load(write_map)
    about = ServerSettings(
        [listen_address(text) for text in addresses], RegisterMap.load(map), writable, speed, expose=expose,
        harm=allow_faults, certificates=certificates,
    )  # fmt: skip
    return BackgroundServer(plants, about)


def record(
    source: str,
    to: str | os.PathLike[str],
    *,
    map: str | None = None,
    rate: float = 10.0,
    ring: bool = False,
    duration: float | None = None,
    device_ids: Sequence[int] = (),
    valves: Sequence[str] = (),
    plant: Plant | None = None,
    title: str | None = None,
    on_event: Callable[[LinkEvent], None] | None = None,
) -> BackgroundRecorder:
    """Record live values into crash-safe recordings while a `with` block lasts. Nothing is written to the plant.

    Parameters
    ----------
    source : str
        ``tcp://HOST:PORT``, ``tls://HOST:PORT?ca=..&cert=..&key=..``, ``rtu:DEVICE?baud=..`` or ``replay:FILE``.
    to : path
        A directory, or a new file ending in .h5 for one valve.
    map : str, optional
        Register map: a file, or a shipped one by name. A replay needs none.
    rate : float, optional
        Polls a second; with `ring`, readings of the ring.
    ring : bool, optional
        Whether every sample is fetched that the device keeps in its ring.
    duration : float, optional
        End after so many seconds.
    device_ids, valves : sequences, optional
        Device ids of equal valves on one line, and a name for each.
    plant, title : Plant, str, optional
        What is known of the valve, and one line for plots.
    on_event : callable, optional
        Called with every event of the link.

    Returns
    -------
    BackgroundRecorder
        A context manager. ``wait(seconds)`` waits for the end; ``report`` has counts and files.

    Raises
    ------
    BadInput
        The source, the map or the place cannot be used.
    LinkError
        On leaving the block, when polling ended by an error. An absent device is no error: it is waited for, and an
        event says so. What was recorded until then is kept.

    >>> import bristle as br, tempfile, pathlib
    >>> path = pathlib.Path(tempfile.mkdtemp()) / "valve.h5"
    >>> with br.serve() as served, br.record(served.address, path, map="damadics", rate=50, duration=0.5) as recorder:
    ...     recorder.wait(10.0)
    True
    >>> len(br.read(path)) > 10
    True
    """
    plan = RingReading(rate) if ring else Polling(rate)
    there = valves_of(RegisterMap.load(map), tuple(device_ids), valves) if map else ()
    live = open_source(source, there, plan, name=valves[0] if valves else None)
    about = RecorderSettings(to=Path(to), title=title, plant=plant or Plant(), tell=on_event)
    return BackgroundRecorder(live, about, duration)
