"""What each kind of work puts into the table of a fleet: its values by column, and a sentence on the valve."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import bristle as br
from recordings import BadInput
from simulator import ValveModel

RowValues = dict[str, Any]
RowAnswer = tuple[Any, RowValues, str]
"""What was found, its values by column, and a sentence."""


def _fit(paths: Sequence[Path], options: Mapping[str, Any]) -> RowAnswer:
    found = br.fit(paths, crosscheck=False, **_of(options, "area", "without", "given", "estimator", "order"))
    values = _model(found.model) | {"converged": found.converged}
    ending = "" if found.converged else f"; {found.fit.outcome.value}"
    return found, values, f"{_friction(found.model)}{ending}"


def _trace(paths: Sequence[Path], options: Mapping[str, Any]) -> RowAnswer:
    found = br.trace(paths, **_of(options, "area", "without", "given", "budget"))
    added = [effect for effect in found.model.effects if effect not in found.base.model.effects]
    values = _model(found.model) | {
        "verdict": found.verdict,
        "effects_added": ",".join(added),
        "complete": found.complete,
    }
    lacks = {"none": "nothing is missing", "unlisted": "something shows that no effect explains"}
    return found, values, f"{lacks.get(found.verdict, f'it shows {found.verdict}')}; {_friction(found.model)}"


def _assess(paths: Sequence[Path], options: Mapping[str, Any]) -> RowAnswer:
    found = br.assess(_only(paths, "assess"), **_of(options, "loop", "columns"))
    values: RowValues = {"verdict": found.verdict, "probability": found.probability}
    for name, one in (("S", found.amount.s), ("J", found.amount.j)) if found.amount else ():
        values |= {f"{name}_percent": one.value, f"{name}_percent.low": one.lower, f"{name}_percent.high": one.upper}
    return found, values, f"{found.verdict}: {found.why}"


def _test(paths: Sequence[Path], options: Mapping[str, Any]) -> RowAnswer:
    kind = str(options.get("kind") or "")
    found = br.test(list(paths), kind)
    values: RowValues = {"kind": kind, "aborted": bool(found.aborted)}
    values |= _flat(found.as_json()["values"])
    told = "; ".join((*found.aborted, *found.lines()[:2])) or "nothing to tell"
    return found, values, told


WORK: Mapping[str, Callable[[Sequence[Path], Mapping[str, Any]], RowAnswer]] = {
    "fit": _fit,
    "trace": _trace,
    "assess": _assess,
    "test": _test,
}
"""What can be done to a fleet, by the name of the command for one valve. Raises BadInput and NegativeAnswer."""


def _of(options: Mapping[str, Any], *names: str) -> dict[str, Any]:
    """The options that a call takes, where they are given; a table gives them as text."""
    found = {name: options[name] for name in names if options.get(name) not in (None, "")}
    for name in ("area", "budget"):
        if isinstance(found.get(name), str):
            try:
                found[name] = float(found[name])
            except ValueError:
                raise BadInput(
                    f"table: {name}", f"{found[name]!r} is not a number", "write for example 0.029"
                ) from None
    return found


def _only(paths: Sequence[Path], what: str) -> Path:
    if len(paths) > 1:
        raise BadInput(f"{paths[0]} and others", f"{what} takes one file", "give each file a row of its own")
    return paths[0]


def _model(model: ValveModel) -> RowValues:
    """Value, standard deviation and status of every parameter, the errors of the free run, and the noise."""
    values: RowValues = {}
    for name, one in model.parameters.items():
        values |= {name: one.value, f"{name}.std": one.std, f"{name}.status": one.status}
    for name, value in (model.error.get("fit") or {}).items():
        values[f"error.{name}"] = value
    values |= {f"noise.{name}": value for name, value in model.noise.items()}
    return values | {"samples": sum(one.samples for one in model.fitted_to)}


def _friction(model: ValveModel) -> str:
    """Friction and spring in a sentence."""
    told = []
    for name, word, scale, unit in (
        ("lugre.fc", "friction", 1.0, "N"),
        ("lugre.fs", "breakaway", 1.0, "N"),
        ("spring.K", "spring", 1e-3, "kN/m"),
    ):
        one = model.parameters.get(name)
        if one is not None:
            error = "" if one.std is None else f" ± {one.std * scale:.2g}"
            told.append(f"{word} {one.value * scale:.4g}{error} {unit}")
    return ", ".join(told)


def _flat(values: Mapping[str, Any], before: str = "") -> RowValues:
    """Numbers and texts of nested values, with their path as the name; lists of steps and the like are left out."""
    flat: RowValues = {}
    for name, value in values.items():
        if isinstance(value, Mapping):
            flat |= _flat(value, f"{before}{name}.")
        elif isinstance(value, bool | int | float | str):
            flat[f"{before}{name}"] = float(value) if isinstance(value, int) and not isinstance(value, bool) else value
    return flat
