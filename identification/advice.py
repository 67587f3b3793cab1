"""Which further experiment would pin what is weak, in words."""

from __future__ import annotations

from identification.uncertainty.covariance import Uncertainty

EXPERIMENT = {
    "mass.m": "fast steps or a multisine up to several hertz: the mass shows only when the stem accelerates",
    "spring.K": "a slow sine or ramp over a good part of the stroke",
    "spring.F0": "a slow sine or ramp over a good part of the stroke, in both directions",
    "lugre.fc": "a slow sine with several reversals at different positions",
    "lugre.fs": "small steps from rest, with a pause before each, so that the stem breaks away often",
    "lugre.vs": "small steps from rest and very slow ramps: the Stribeck region is passed only at low speed",
    "lugre.sigma0": "presliding: a small sine below break-away about a position at rest, finely resolved",
    "lugre.sigma1": "small steps sampled at 1 kHz or more: the bristle damping shows for some milliseconds only",
    "lugre.sigma2": "strokes at several speeds: viscous friction is told from Coulomb friction by its slope",
}
"""Parameter -> the experiment that teaches it."""


def advice(known: Uncertainty) -> tuple[str, ...]:
    """One sentence for every parameter that is weak or at its bound, one for all that the sampling does not tell."""
    found = []
    for name, status in known.status.items():
        if status in ("weak", "at_bound"):
            why = known.note.get(
                name, "the recordings say little about it" if status == "weak" else "it went to its bound"
            )
            found.append(f"{name}: {why}; to pin it, record {EXPERIMENT.get(name, 'more varied motion')}.")
    reasons = dict.fromkeys(known.note[name] for name, status in known.status.items() if status == "unresolved")
    for why in reasons:
        names = [name for name, status in known.status.items() if status == "unresolved" and known.note[name] == why]
        found.append(f"{', '.join(names)}: not told by these recordings: {why}.")
    return tuple(found)
