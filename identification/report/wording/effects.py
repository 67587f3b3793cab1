"""Effects in words: names without underscores, and how big an effect is."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from identification.report.wording.numbers import NARROW, with_std
from simulator import Effect, ValveModel

SHOWN = {"m": (1e3, "mm"), "m/s": (1e3, "mm/s")}
"""SI unit -> factor and unit in which a parameter of an effect is written; all others as they are."""
POWERS = str.maketrans("23", "²³")


def effect_name(effect: str) -> str:
    """The id of an effect as words.

    >>> effect_name("hardening_spring")
    'hardening spring'
    """
    return effect.replace("_", " ")


def listed(names: Sequence[str], last: str = "and") -> str:
    """Names in a sentence.

    >>> listed(["a", "b", "c"])
    'a, b and c'
    """
    return f" {last} ".join(part for part in (", ".join(names[:-1]), *names[-1:]) if part)


def sizes(effect: Effect, model: ValveModel) -> Iterator[str]:
    """How big an effect is, one phrase a fitted parameter."""
    for parameter in effect.parameters:
        value = model.parameters.get(effect.parameter_name(parameter.symbol))
        if value is None or value.status == "given":
            continue
        factor, unit = SHOWN.get(value.unit, (1.0, "" if value.unit == "1" else value.unit.translate(POWERS)))
        shown, std = with_std(factor * value.value, None if value.std is None else factor * value.std)
        doubt = f" ± {std}" if std else ""
        yield f"{parameter.meaning}: {shown}{doubt}{NARROW}{unit}".rstrip(NARROW)
