"""A comparison on the terminal."""

from __future__ import annotations

from typing import TYPE_CHECKING

from bristle.cli.output.tables import words_table

if TYPE_CHECKING:
    from rich.table import Table

    from identification import ValveComparison


def quantity_table(found: ValveComparison) -> Table:
    """Every quantity before and after, with the interval of its difference."""
    rows = []
    for q in found.quantities:
        interval = f"{q.difference:+.3g} ({q.lower:+.3g} to {q.upper:+.3g})"
        rows.append((
            q.name, q.unit, f"{q.before.value:.5g} ± {q.before.std:.2g}", f"{q.after.value:.5g} ± {q.after.std:.2g}",
            interval, "yes" if q.changed else "no",
        ))  # fmt: skip
    return words_table(("quantity", "unit", "before", "after", "difference", "changed"), rows)
