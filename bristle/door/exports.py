"""Models and recordings for other programs: `bristle export` as a call."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Literal, get_args

from bristle.door.sources import read
from identification import Identification, Trace
from recordings import BUNDLED, BadInput, BadParameter, Recording, write_table
from simulator import CATALOGUE, FINE_STEP, Catalogue, ValveModel
from simulator.export import ExportedStep, write_c, write_casadi, write_fmu

Target = Literal["c", "casadi", "fmu", "parquet", "matlab"]
"""What something can be exported to: a model to the first three, a recording to the others."""
ENDINGS = {"c": ".c", "casadi": ".casadi", "fmu": ".fmu", "parquet": ".parquet", "matlab": ".mat"}


def export(
    source: ValveModel | Identification | Trace | Recording | str | os.PathLike[str],
    to: Target,
    out: str | os.PathLike[str] | None = None,
    *,
    hold: bool = False,
    longest_step: float = FINE_STEP,
    sub_steps: int = 1,
    catalogue: Catalogue = CATALOGUE,
) -> tuple[Path, ...]:
    """Write a model or a recording for use outside of this toolkit.

    Parameters
    ----------
    source : model, fit, trace, recording or path
        What to export; a path of a ``model.json``, of a recording, or ``bundled:NAME``.
    to : {"c", "casadi", "fmu", "parquet", "matlab"}
        A model: C source with one step function and a header; a CasADi function; a functional mock-up unit (FMI 2.0,
        co-simulation; extra ``fmu``). A recording: a Parquet file (extra ``parquet``) or a MATLAB file, of which
        `bristle import` makes the same recording.
    out : path, optional
        Where to write; the name of the source with another ending, in this folder, where not given.
    hold : bool, optional
        C source: whether the force is held during a step; else it runs linearly to its value at the end.
    longest_step : float, optional
        C source and unit: longest sub-step of the integration [s].
    sub_steps : int, optional
        CasADi function: into how many equal parts a step is divided.
    catalogue : Catalogue, optional
        Where the effects of the model are looked up.

    Returns
    -------
    tuple of Path
        The files that were written.

    Raises
    ------
    BadInput
        The source cannot be exported to that, a package or a compiler is missing, or the disk refuses.

    >>> import bristle as br, tempfile
    >>> folder = tempfile.mkdtemp()
    >>> [path.name for path in br.export("bundled:step", "matlab", f"{folder}/step.mat")]
    ['step.mat']
    """
    if to not in get_args(Target):
        raise BadParameter("to", to, "it is not an allowed value", f"use one of {', '.join(get_args(Target))}")
    if not longest_step > 0 or longest_step == float("inf"):
        raise BadParameter("longest_step", longest_step, "it is not a positive number", "give seconds, such as 5e-5")
    if sub_steps < 1:
        raise BadParameter("sub_steps", sub_steps, "there is no such step", "give 1 or more")
    path = Path(out) if out is not None else Path(_stem(source) + ENDINGS[to])
    if to == "parquet" or to == "matlab":
        write_table(path, _recording(source, to), to)
        return (path,)
    step = ExportedStep(_model(source, to, catalogue), catalogue)
    if to == "c":
        return write_c(step, path, hold=hold, longest_step=longest_step)
    if to == "casadi":
        return (write_casadi(step, path, sub_steps=sub_steps),)
    return (write_fmu(step, path, longest_step=longest_step),)


def _stem(source: object) -> str:
    """The name of a source without ending and folder."""
    if isinstance(source, str | os.PathLike):
        return Path(os.fspath(source).removeprefix(BUNDLED)).stem
    if isinstance(source, Recording):
        return source.path.stem if source.path else "recording"
    return "model"


def _recording(source: object, to: str) -> Recording:
    if isinstance(source, Recording) or (isinstance(source, str | os.PathLike) and not _is_json(source)):
        return read(source)
    raise BadInput(_named(source), f"a model cannot be exported to {to}", "use c, casadi or fmu")


def _model(source: object, to: str, catalogue: Catalogue) -> ValveModel:
    if isinstance(source, Identification | Trace):
        return source.model
    if isinstance(source, ValveModel):
        return source
    if isinstance(source, str | os.PathLike) and _is_json(source):
        return ValveModel.read(source, catalogue)
    raise BadInput(_named(source), f"a recording cannot be exported to {to}", "use parquet or matlab")


def _is_json(source: str | os.PathLike[str]) -> bool:
    return os.fspath(source).lower().endswith(".json")


def _named(source: object) -> str:
    return os.fspath(source) if isinstance(source, str | os.PathLike) else repr(source)
