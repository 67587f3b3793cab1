"""Candidates that recordings cannot tell apart: one class, of which the simplest is taken."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from identification.tracing import settings
from identification.tracing.judge import Candidate
from identification.tracing.models.comparison import compare
from identification.tracing.several import n_free_parameters
from simulator import Catalogue


def ranked(candidates: Sequence[Candidate], catalogue: Catalogue) -> list[Candidate]:
    """Candidates that were judged, best first, of which only one stays accepted: of those that explain as much as the
    best, the simplest.
    """
    order = sorted(candidates, key=lambda c: (not c.accepted, -(c.gain + (c.held_out.gain if c.held_out else 0.0))))
    accepted = [c for c in order if c.accepted]
    if not accepted:
        return order
    best, alike = accepted[0], same_class(accepted)
    first = min(
        (c for c in accepted if c is best or c.effect in alike), key=lambda c: n_free_parameters(c.effect, catalogue)
    )
    reasons = dict.fromkeys((*alike, best.effect), f"cannot be told from {first.effect}")
    others = [
        replace(c, accepted=False, why=reasons.get(c.effect, "explains less than the one accepted"))
        if c.accepted
        else c
        for c in order
        if c is not first
    ]
    return [first, *others]


def same_class(candidates: Sequence[Candidate]) -> tuple[str, ...]:
    """The candidates that explain the held-out data as well as the first."""
    return tuple(c.effect for c in candidates[1:] if _is_alike(candidates[0], c))


def _is_alike(best: Candidate, other: Candidate) -> bool:
    """Whether another candidate gains about as much as the best on all recordings, or not significantly less held out
    and fitted hardly less."""
    if other.held_out is None or other.refit is None or other.held_out.gain <= 0:
        return False
    assert best.held_out is not None
    assert best.refit is not None
    held_out, fitted = abs(other.held_out.gain - best.held_out.gain), abs(other.gain - best.gain)
    most = max(best.gain + best.held_out.gain, other.gain + other.held_out.gain)
    if held_out + fitted < settings.SMALL_SHARE * most:
        return True
    assert best.refit.held_out is not None
    assert other.refit.held_out is not None
    against = compare(other.refit.held_out, best.refit.held_out, best.refit.data.held_out)
    return fitted < settings.MIN_GAIN and against.p_value > settings.LEVEL / 2


def one_accepted(candidates: Sequence[Candidate], effect: str) -> tuple[tuple[Candidate, ...], tuple[str, ...]]:
    """The candidates of the first round where one effect is left in the end, and what cannot be told from it. It may
    have been found beside the one that was accepted first, which is then not needed.
    """
    first = candidates[0].effect
    alike = (first, *same_class(candidates))
    others = tuple(e for e in alike if e != effect) if effect in alike else ()
    return in_the_end(candidates, (first,), (effect,)), others


def several_accepted(
    rounds: Sequence[Sequence[Candidate]], added: tuple[str, ...]
) -> tuple[tuple[Candidate, ...], tuple[str, ...]]:
    """The candidates of the first round where several effects were added and there is no time to try others in their
    place, and what could not be told from the first of them in the round in which it was accepted.
    """
    others = next((same_class(some) for some in rounds if some[0].effect == added[0]), ())
    return in_the_end(rounds[0], added, added), tuple(e for e in others if e not in added)


def in_the_end(
    candidates: Sequence[Candidate], accepted: tuple[str, ...], final: tuple[str, ...]
) -> tuple[Candidate, ...]:
    """The candidates of the first round as later rounds left them, the final effects first. accepted : effects that
    were accepted in any round.
    """
    changed = [
        replace(c, accepted=False, why="another does as well or better in the end")
        if c.accepted and c.effect not in final
        else replace(c, accepted=True, why="does best in the end")
        if c.effect in final and c.effect not in accepted
        else c
        for c in candidates
    ]
    return tuple(sorted(changed, key=lambda c: not c.accepted))
