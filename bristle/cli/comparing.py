"""A comparison on the terminal."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rich.table import Column, Table

if TYPE_CHECKING:
    from identification import ValveComparison


def quantity_table(found: ValveComparison) -> Table:
    """Every quantity before and after, with the interval of its difference."""
    table = Table(Column("quantity", no_wrap=True), "unit", "before", "after", "difference", "changed")
    for q in found.quantities:
        interval = f"{q.difference:+.3g} ({q.lower:+.3g} to {q.upper:+.3g})"
        table.add_row(
            q.name, q.unit, f"{q.before.value:.5g} ± {q.before.std:.2g}", f"{q.after.value:.5g} ± {q.after.std:.2g}",
            interval, "yes" if q.changed else "no",
        )  # fmt: skip
    return table
