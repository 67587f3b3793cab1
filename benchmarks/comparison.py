"""How often `compare` finds a change, and how often it sees one where there is none.

    python -m benchmarks.comparison --valves 40 --first 300

Random valves of `simulator.random_valve`; before and after have a staircase of 30 s and a sine of 40 s at 100 Hz, with
other positions and other noise (2e-4 of the stroke, 0.1 % of the spring's force over it). Seeds 100 to 105 and 200 to
211 were used to develop the method, and are not for judging it.
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping

import bristle as br
from benchmarks.machine import machine
from identification import ValveComparison
from recordings import NegativeAnswer
from simulator import BASE, Excitation, Sensors, random_valve, simulate

SPOT = "position_dependent_friction"
CHANGES = ("nothing", "friction +15 %", "spring +5 %", "tight spot of 40 %")
COURSE = "staircase:30,sine:40"


def changed(change: str, values: Mapping[str, float], stroke: float) -> dict[str, float]:
    """The values of a valve after a change."""
    if change == CHANGES[1]:
        return {**values, "lugre.fc": 1.15 * values["lugre.fc"], "lugre.fs": 1.15 * values["lugre.fs"]}
    if change == CHANGES[2]:
        return {**values, "spring.K": 1.05 * values["spring.K"]}
    if change == CHANGES[3]:
        shape = {"a": 0.4, "x0": 0.5 * stroke, "w": 0.05 * stroke, "b": 0.0}
        return {**values, **{f"{SPOT}.{symbol}": value for symbol, value in shape.items()}}
    return dict(values)


def compared(change: str, seed: int) -> ValveComparison | None:
    """A valve before and after a change, compared; None where the recordings do not tell."""
    values, stroke = random_valve(seed)
    sensors = Sensors(100.0, position_noise=2e-4 * stroke, force_noise=1e-3 * values["spring.K"] * stroke)
    later = changed(change, values, stroke)
    pair = []
    for i, one in enumerate((values, later)):
        effects = (*BASE, SPOT) if f"{SPOT}.a" in one else BASE
        pair.append(
            simulate(one, Excitation.parse(COURSE), sensors, stroke=stroke, seed=2 * seed + i, effects=effects)[0]
        )
    try:
        return br.compare(*pair)
    except NegativeAnswer:
        return None


def found(change: str, answer: ValveComparison) -> bool:
    """Whether the change is seen in the right quantity, or for no change whether any is seen."""
    if change == CHANGES[0]:
        return bool(answer.changed or answer.places)
    if change == CHANGES[3]:
        return bool(answer.places)
    return ("friction" if change == CHANGES[1] else "spring rate") in answer.changed


def main() -> None:
    """Print the table."""
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--valves", type=int, default=40)
    options.add_argument("--first", type=int, default=300, help="seed of the first valve")
    asked = options.parse_args()
    print(machine("numpy", "scipy"))
    seeds = range(asked.first, asked.first + asked.valves)
    for change in CHANGES:
        answers = {seed: compared(change, seed) for seed in seeds}
        told = {seed: answer for seed, answer in answers.items() if answer is not None}
        seen = [seed for seed, answer in told.items() if found(change, answer)]
        word = "called changed" if change == CHANGES[0] else "seen"
        odd = seen if change == CHANGES[0] else [seed for seed in told if seed not in seen]
        print(
            f"{change}: {len(seen)} of {len(told)} {word}, {len(seeds) - len(told)} without an answer; {odd}",
            flush=True,
        )


if __name__ == "__main__":
    main()
