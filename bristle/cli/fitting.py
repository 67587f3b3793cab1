"""What `bristle fit` checks in its options, and what it prints besides the fit."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

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


def compare_models(
    recordings: Sequence[str],
    *,
    free_run: bool,
    out: Path | None,
    report: Path | None,
    given: Sequence[str] | None,
    without: Sequence[str] | None,
    **options: Any,
) -> None:
    """Compare models of friction, by the force that the motion takes or by free runs; print, answer and write it."""
    import bristle as br
    from bristle.cli.console import assignments
    from bristle.cli.output.manner import answer, stdout
    from bristle.cli.output.working import working

    with working("fitting", staged=True) as progress:
        compared: FrictionComparison | FreeComparison = (
            br.compare_free_runs(recordings, given=assignments(given or [], "--given"), progress=progress, **options)
            if free_run
            else br.compare_friction(recordings, without=without or (), progress=progress, **options)
        )
    print_comparison(stdout(), compared)
    answer(compared.as_json())
    if out:
        compared.write(out)
    if report:
        compared.report(report)


def print_comparison(console: Console, found: FrictionComparison | FreeComparison) -> None:
    """The tables of a comparison of friction models: the errors, best first, and the parameters of the best."""
    from bristle.cli.output.tables import words_table

    shown = found.findings()
    console.print(*shown.sentences, sep="\n")
    for heads, rows in shown.tables:
        console.print(words_table(heads, rows), soft_wrap=False)
    console.print(f"{shown.opening.why}; {shown.opening.sure}")
