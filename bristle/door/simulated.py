"""A simulated valve in the hands of a test, from plain values."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping

from bristle.door.plant_file import SimulatedPlantFile
from bristle.door.plants import EffectSizes, actuator
from hil import RegisterMap, ServerSettings, WriteMap, listen_address
from hil.testing import SimulatedValve
from simulator import CATALOGUE, Catalogue
from simulator.damadics import Fault, Stimulus


def simulated_valve(
    *,
    plant: str | os.PathLike[str] | None = None,
    listen: str = "tcp://127.0.0.1:0",
    map: str | None = None,
    write_map: str | None = None,
    speed: float | None = None,
    scenario: str | None = None,
    stimulus: Stimulus | None = None,
    friction: str | None = None,
    faults: Iterable[Fault] = (),
    settings: Mapping[str, float] | None = None,
    effects: EffectSizes | None = None,
    catalogue: Catalogue = CATALOGUE,
    noise: bool | None = None,
    seed: int | None = None,
    name: str = "valve",
) -> SimulatedValve:
    """A simulated valve behind Modbus for the test of a controller or of any other client.

    Parameters
    ----------
    plant : path, optional
        A plant file; the other parameters come on top of it.
    listen : str, optional
        ``tcp://127.0.0.1:0`` (any free port), or ``pty:`` for Modbus RTU on a pseudo terminal.
    map, write_map : str, optional
        Register maps: a file, or a shipped one by name; ``damadics``, ``damadics-write`` and ``none`` are some.
    speed : float, optional
        Times real time; None for lock-step, where time moves by `SimulatedValve.advance` alone.
    scenario, stimulus, friction, faults, settings, effects, catalogue, noise, seed : optional
        The valve, as in `serve`.
    name : str, optional
        What to call it, in reports and file names.

    Returns
    -------
    SimulatedValve
        A context manager; ``endpoint`` is where clients find it.

    Raises
    ------
    BadInput
        A file, a name or a value cannot be used.

    >>> import bristle as br
    >>> with br.simulated_valve(settings={"setpoint": 0.3}) as valve:
    ...     valve.wait_until(lambda now: now["position"] > 0.011) < 10.0
    True
    """
    base = SimulatedPlantFile() if plant is None else SimulatedPlantFile.load(plant)
    made = actuator(
        scenario or base.scenario, friction or base.friction, [*(one.fault() for one in base.fault), *faults],
        {**base.set, **(settings or {})}, {**base.effect, **(effects or {})}, stimulus=stimulus,
        effects_on=not base.effect_off, catalogue=catalogue, noise=base.noise if noise is None else noise,
        seed=base.seed if seed is None else seed,
    )  # fmt: skip
    writable = write_map or base.write_map
    about = ServerSettings(
        [listen_address(listen)], RegisterMap.load(map or base.map),
        None if writable == "none" else WriteMap.load(writable), speed, harm=True,
    )  # fmt: skip
    return SimulatedValve(made, about, name)
