"""A valve model as C source with one step function, which needs nothing but the C library and its mathematics."""

from __future__ import annotations

import functools
from pathlib import Path
from typing import NamedTuple

from jinja2 import Environment, PackageLoader, StrictUndefined

from recordings import save_text
from simulator.export.casadi_to_c import c_statements, constant
from simulator.export.step_parts import ExportedStep, program_name
from simulator.simulation import FINE_STEP


class CSource(NamedTuple):
    """The text of a header and of the source that belongs to it."""

    header: str
    source: str


@functools.cache
def environment() -> Environment:
    """The templates of this folder."""
    return Environment(
        loader=PackageLoader("simulator.export"), undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True,
        keep_trailing_newline=True, autoescape=lambda name: str(name).endswith(".xml"),
    )  # fmt: skip


def c_source(
    step: ExportedStep, name: str = "valve", *, hold: bool = False, longest_step: float = FINE_STEP, title: str = ""
) -> CSource:
    """The C source of a model, C99.

    Parameters
    ----------
    step : ExportedStep
        The model.
    name : str
        What every public name begins with.
    hold : bool
        Whether the force is held during a step; else it runs linearly to the value that is given.
    longest_step : float
        Longest sub-step of the integration [s]; that of the simulated recordings where not given.
    title : str
        Where the model is from, for a comment.

    Returns
    -------
    CSource
        Header and source.
    """
    name = program_name(name)
    about = {
        "name": name, "NAME": name.upper(), "step": step, "hold": hold, "longest_step": repr(float(longest_step)),
        "title": _one_line(title), "scale": repr(float(step.recurrence.scale)), "body": _bodies(step),
        "number": lambda value: constant(value).text, "comment": _one_line,
        "start": lambda start: start if isinstance(start, str) else constant(start).text,
    }  # fmt: skip
    return CSource(*(environment().get_template(file).render(about) for file in ("model.h", "model.c")))


def write_c(
    step: ExportedStep, path: Path, *, hold: bool = False, longest_step: float = FINE_STEP
) -> tuple[Path, Path]:
    """Write the source to a path and its header beside it; every public name begins with the name of the file.

    Returns the paths of source and header. Raises BadInput when they cannot be written.
    """
    made = c_source(step, path.stem, hold=hold, longest_step=longest_step, title=path.stem)
    header = path.with_name(f"{program_name(path.stem)}.h")
    save_text(header, made.header)
    save_text(path, made.source)
    return path, header


def _bodies(step: ExportedStep) -> dict[str, list[str]]:
    """The statements of the four functions of the step."""
    states = [state.name for state in step.states]
    late = 2 if step.delay else 0
    exo = ["e->time", "e->h", "e->force", *("e->late", "0.0")[:late]]
    if step.recurrence.ends:
        exo += ["e->force_end", *("e->late_end", "0.0")[:late]]
    vectors = {
        "w": ["w"], "s": [f"s->{name}" for name in states], "e": exo, "p": [f"p->{one.name}" for one in step.parameters]
    }  # fmt: skip
    targets = {
        "guess": [["const double guess"]], "residual": [["*value"], ["*slope"]],
        "step": [[f"next->{name}" for name in states]], "output": [["const double position"]],
    }  # fmt: skip
    return {
        name: c_statements(function, [vectors[letter] for letter in function.name_in()], targets[name])
        for name, function in step.functions.items()
    }


def _one_line(text: str) -> str:
    """A text that can stand in a C comment."""
    return " ".join(text.replace("*/", "* /").replace("\\", "/").split())
