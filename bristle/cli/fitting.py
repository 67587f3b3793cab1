"""What `bristle fit` checks in its options, and what it prints besides the fit."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING

from recordings import BadInput, BadParameter

if TYPE_CHECKING:
    from rich.console import Console

    from identification import FreeComparison, FrictionComparison, Identification


def profiled(names: Sequence[str], held: Mapping[str, float]) -> Sequence[str]:
    """The names to profile. Raises BadParameter for one that the base model has not, or that is held."""
    from identification import free_parameters

    free = free_parameters(held)
    for name in names:
        if name not in free:
            raise BadParameter("profile", name, "it is no free parameter of this fit", f"there are {', '.join(free)}")
    return names


def priors(texts: Iterable[str]) -> dict[str, tuple[float, float]]:
    """Means and standard deviations by name, from ``NAME=MEAN+-STD``. Raises BadInput."""
    found = {}
    for text in texts:
        name, _, value = text.partition("=")
        mean, _, std = value.replace("±", "+-").partition("+-")
        try:
            found[name.strip()] = float(mean), float(std)
        except ValueError:
            raise BadInput(
                f"--prior {text!r}", "it is no prior", "write NAME=MEAN+-STD, as in mass.m=2.1+-0.2"
            ) from None
    return found


def print_profiles(console: Console, found: Identification, names: Iterable[str]) -> None:
    """The profile likelihoods of some parameters."""
    from identification import profile

    for name in names:
        p = profile(found.fit, found.uncertainty, name)
        low, high = (f"{x:.6g}" if x is not None else "(no end found)" for x in (p.lower, p.upper))
        console.print(f"profile of {name}: 90 % interval from {low} to {high}")


def refuse_others(options: Mapping[str, object]) -> None:
    """Refuse options of the fit of a whole valve beside those that compare friction. Raises BadInput."""
    for name, value in options.items():
        if value:
            raise BadInput(
                name, "it belongs to the fit of a valve, not to this comparison of friction models", "leave it out"
            )


def print_comparison(console: Console, found: FrictionComparison | FreeComparison) -> None:
    """The table of friction models, by the force or by free runs."""
    from identification import FreeComparison

    if isinstance(found, FreeComparison):
        print_free_runs(console, found)
    else:
        print_friction(console, found)


def print_free_runs(console: Console, found: FreeComparison) -> None:
    """The table of free runs, best first, and the parameters of the best."""
    from rich.table import Table

    table = Table("friction", "model", "parameters", "fitted", "held out", title="RMS error of free runs, in µm")
    for row in found.rows:
        errors = (f"{1e6 * error:.4g}" for error in (row.fitted_m, row.held_out_m))
        table.add_row(row.name, row.model.text, str(row.parameters), *errors)
    console.print(table)
    console.print(f"{found.split}; from the first sample on only the recorded force enters")
    for row in found.rows:
        if row.fit.outcome.name != "CONVERGED":
            console.print(f"{row.name}: {row.fit.outcome.value}")
    best = Table("parameter", "value", "unit", title=f"{found.best.name}: least error on what was held out")
    for name, value in found.best.values.items():
        best.add_row(name, f"{value:.5g}", found.best.unit(name))
    console.print(best)


def print_friction(console: Console, found: FrictionComparison) -> None:
    """The table of friction models, best first, and the parameters of the best."""
    from rich.table import Table

    table = Table("friction", "model", "parameters", "fitted [N]", "held out [N]", title="Error of the force, RMS")
    before = found.before_n
    for row in found.rows:
        table.add_row(
            row.name, row.fit.model.text, str(row.fit.parameters), f"{row.fitted_n:.4g}", f"{row.held_out_n:.4g}"
        )
    table.add_row("none", "before: no friction", "-", f"{before[0]:.4g}", f"{before[1]:.4g}")
    console.print(table)
    console.print(f"{found.split}; the motion is as recorded")
    best = Table("parameter", "value", "unit", title=f"{found.best.name}: least error on what was held out")
    for name, (value, unit) in found.best.fit.values.items():
        best.add_row(name, f"{value:.5g}", unit)
    console.print(best)
