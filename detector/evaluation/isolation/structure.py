"""Which faults the relations of the plant can tell apart at all, whatever the numbers: structural isolability.

Relations of the benchmark (Syfert et al., 2002): r1 X = (Ps, Fvc), r2 Fv = (X, P1, P2, T1), r3 Fvc = (X, P1, P2, T1),
r4 Fv3 = (P1, P2, T1, X3), r5 CVI = (CV, X), r6 Ps = (CVI, Pz, X), r7 F = (Fv, Fv3).
"""

from __future__ import annotations

from collections.abc import Mapping

RELATIONS: Mapping[str, tuple[str, frozenset[str]]] = {
    "r1": ("X", frozenset({"Ps", "Fvc"})),
    "r2": ("Fv", frozenset({"X", "P1", "P2", "T1"})),
    "r3": ("Fvc", frozenset({"X", "P1", "P2", "T1"})),
    "r4": ("Fv3", frozenset({"P1", "P2", "T1", "X3"})),
    "r5": ("CVI", frozenset({"CV", "X"})),
    "r6": ("Ps", frozenset({"CVI", "Pz", "X"})),
    "r7": ("F", frozenset({"Fv", "Fv3"})),
}
"""What each relation gives, and from what."""

MEASURED = frozenset({"CV", "P1", "P2", "T1", "X", "F"})
GIVEN = frozenset({"Pz", "X3"})
"""Not measured, but constant as long as nothing is wrong: supply pressure, and the bypass closed."""

TOUCHED: Mapping[int, frozenset[str]] = {
    1: frozenset({"r1"}), 2: frozenset({"r1", "r2"}), 3: frozenset({"r1", "r2"}), 4: frozenset({"r1"}),
    5: frozenset({"r2"}), 6: frozenset({"r2"}), 7: frozenset({"r2", "r3"}), 8: frozenset({"r1"}),
    9: frozenset({"r6"}), 10: frozenset({"r1", "r6"}), 11: frozenset({"r1"}), 12: frozenset({"r6"}),
    13: frozenset({"X"}), 14: frozenset({"Ps'"}), 15: frozenset({"r5"}), 16: frozenset({"Pz"}),
    17: frozenset({"process"}), 18: frozenset({"X3"}), 19: frozenset({"F"}),
}  # fmt: skip
"""Relations, sensors and constants that each fault changes; f14 touches only a sensor outside the basic set."""


def tests() -> dict[str, frozenset[str]]:
    """The checks that only measured and given quantities enter, each with all it relies on: for every measured quantity
    that a relation gives, the relation with everything unmeasured in it replaced by what gives that. The process
    signals themselves, against their usual range, are one more.
    """
    found = {}
    for name, (gives, needs) in RELATIONS.items():
        if gives in MEASURED:
            found[f"{gives} by {name}"] = frozenset({gives, name}) | _support(needs)
    return found | {"usual range": frozenset({"process"})}


def _support(needs: frozenset[str]) -> frozenset[str]:
    """Measured and given quantities and relations that unmeasured quantities rest on."""
    rests: set[str] = set()
    for quantity in needs:
        if quantity in MEASURED | GIVEN:
            rests.add(quantity)
            continue
        name, (_, further) = next((n, r) for n, r in RELATIONS.items() if r[0] == quantity)
        rests |= {name} | _support(further)
    return frozenset(rests)


def signatures() -> dict[int, tuple[bool, ...]]:
    """For each fault which of `tests` it violates."""
    checks = tests()
    return {fault: tuple(bool(parts & touched) for parts in checks.values()) for fault, touched in TOUCHED.items()}


def groups() -> list[tuple[int, ...]]:
    """Faults of equal signature, which structure alone cannot tell apart; the last may be those that none shows.

    >>> groups()[0]
    (1, 4, 8, 9, 10, 11, 12, 15, 16)
    """
    by_signature: dict[tuple[bool, ...], list[int]] = {}
    for fault, signature in signatures().items():
        by_signature.setdefault(signature, []).append(fault)
    return [tuple(faults) for faults in by_signature.values()]
