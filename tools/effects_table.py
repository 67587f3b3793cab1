"""Write the tables of all effects into docs/effects.md.

Run from the repository: python -m tools.effects_table
"""

from __future__ import annotations

import inspect
import math
from pathlib import Path

from simulator import CATALOGUE, Effect, Parameter

PAGE = Path(__file__).resolve().parents[1] / "docs" / "effects.md"
HEADING = "## The catalogue\n"
INTRODUCTION = """
Equation numbers are those of the source document, Chapter 2. A friction level is that of LuGre, fc and fs alike.
`off` is the value at which an effect vanishes; a parameter without one gives the effect its shape, and where it says
`held` it is to be known and not fitted. `python -m tools.effects_table` writes these tables from the catalogue.
"""


def tables() -> str:
    """Both tables as Markdown: what the effects are, and their parameters."""
    effects = ["| effect | acts on | equation | for a valve | to check on site |", "| --- | --- | --- | --- | --- |"]
    parameters = ["| parameter | unit | meaning | typical | off | range |", "| --- | --- | --- | --- | --- | --- |"]
    for effect in CATALOGUE.effects:
        what = f"{_first(inspect.getdoc(inspect.getmodule(type(effect))))} {_first(inspect.getdoc(type(effect)))}"
        cells = f"`{effect.id}`", effect.site.value, what.replace("|", "\\|"), effect.sentence, effect.check
        effects.append(f"| {' | '.join(cells)} |")
        parameters += [_row(effect, parameter) for parameter in effect.parameters]
    return "\n".join([*effects, "", *parameters]) + "\n"


def section() -> str:
    """The last section of the page, from its heading on."""
    return f"{HEADING}{INTRODUCTION}\n{tables()}"


def _row(effect: Effect, p: Parameter) -> str:
    off = "held" if p.known else "" if p.neutral is None else f"{p.neutral:g}"
    low = f"from {p.lower:g}" if math.isfinite(p.lower) else ""
    high = f"to {p.upper:g}" if math.isfinite(p.upper) else ""
    cells = f"`{effect.parameter_name(p.symbol)}`", p.unit, p.meaning, f"{p.scale:g}", off, f"{low} {high}".strip()
    return f"| {' | '.join(cells)} |"


def _first(text: str | None) -> str:
    return (text or "").splitlines()[0]


def main() -> None:
    """Replace the section in the page."""
    text = PAGE.read_text(encoding="utf-8")
    PAGE.write_text(text.partition(HEADING)[0].rstrip() + "\n\n" + section(), encoding="utf-8")


if __name__ == "__main__":
    main()
