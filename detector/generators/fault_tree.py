"""Logic reasoning: rules IF symptom AND symptom THEN conclusion, each conclusion a symptom of further rules (3.2.1)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from detector.generators.contract import Generator
from recordings import Array, BadInput


@dataclass(frozen=True)
class Rule:
    """IF all of `present` and none of `absent` THEN `conclusion`."""

    conclusion: str
    present: tuple[str, ...] = ()
    absent: tuple[str, ...] = ()

    def words(self) -> str:
        """The rule as a sentence."""
        conditions = [*self.present, *(f"NOT {name}" for name in self.absent)]
        return f"IF {' AND '.join(conditions)} THEN {self.conclusion}"


@dataclass(frozen=True)
class FaultTree(Generator):
    """Conclusions, 0 or 1, from symptoms: outputs named `symptoms`, present where beyond `limit` in size.

    A symptom named with a trailing + or - in a rule asks for its sign. Several rules of one conclusion are joined by
    OR. Rules are worked through in order, so a rule may use conclusions of those before it. Raises BadInput for a rule
    about something that is neither a symptom nor concluded before.

    >>> tree = FaultTree(("flow", "position"), (Rule("sensor", ("flow+",), ("position",)), Rule("stop", ("sensor",))))
    >>> tree.run(tree.initial(), np.zeros((2, 0)), [[5.0, 0.0], [5.0, 4.0]])[1].tolist()
    [[1.0, 1.0], [0.0, 0.0]]
    """

    symptoms: tuple[str, ...]
    rules: tuple[Rule, ...]
    limit: float = 3.0

    def __post_init__(self) -> None:
        known = {name + sign for name in self.symptoms for sign in ("", "+", "-")}
        for rule in self.rules:
            for name in (*rule.present, *rule.absent):
                if name not in known:
                    remedy = f"symptoms are {', '.join(self.symptoms)}, or conclusions of earlier rules"
                    raise BadInput("fault tree", f"'{name}' in '{rule.words()}' is not known", remedy)
            known.add(rule.conclusion)

    @property
    def conclusions(self) -> tuple[str, ...]:
        """What can be concluded, in the order of the residuals."""
        return tuple(dict.fromkeys(rule.conclusion for rule in self.rules))

    @property
    def width(self) -> tuple[int, int, int]:
        """No inputs; outputs are symptoms; one residual per conclusion."""
        return 0, len(self.symptoms), len(self.conclusions)

    def initial(self) -> Array:
        """Nothing to remember."""
        return np.zeros(0)

    def _advance(self, state: Array, u: Array, y: Array) -> tuple[Array, Array]:
        facts: dict[str, Any] = {}
        for place, name in enumerate(self.symptoms):
            above, below = y[:, place] > self.limit, y[:, place] < -self.limit
            facts |= {name: above | below, f"{name}+": above, f"{name}-": below}
        for rule in self.rules:
            holds = np.logical_and.reduce([facts[n] for n in rule.present] + [~facts[n] for n in rule.absent])
            facts[rule.conclusion] = facts.get(rule.conclusion, np.zeros(len(y), bool)) | holds
        return state, np.column_stack([facts[name] for name in self.conclusions]).astype(float)


def explain(tree: FaultTree, facts: Mapping[str, bool] | Sequence[str]) -> list[str]:
    """The rules that fire when some symptoms are present, as sentences, in order."""
    true = set(facts if not isinstance(facts, Mapping) else [name for name, there in facts.items() if there])
    fired = []
    for rule in tree.rules:
        if all(name in true for name in rule.present) and not any(name in true for name in rule.absent):
            true.add(rule.conclusion)
            fired.append(rule.words())
    return fired
