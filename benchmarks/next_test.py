"""How many cases a proposed test settles, against a staircase and a sine of the same length.

    python -m benchmarks.next_test --cases 4 --first 100

A case is a seeded valve after a short step: even seeds where a parameter is weak after it, odd seeds where a rival
effect explains it as well. Then each test is run on the true valve, with noise, and fitted together with the step by
`identify`, the code of `bristle fit`. A weak parameter is told when it is identified afterwards and within 30 % of the
truth; a case is settled when all of them are, or when the rival fits worse by five sigmas. Development seeds are 0
to 40.
"""

from __future__ import annotations

import argparse
from collections import Counter
from collections.abc import Iterator, Mapping

import numpy as np

from identification import Identification, identify
from identification.next_test import REFERENCES, DesignBounds, DrivenTest, KnownValve, drive_of, known_valve, next_test
from recordings import BristleError, Plant, Recording
from simulator import BASE, CATALOGUE, Value, ValveModel, random_valve

NOISE, RATE, SECONDS, SUB_STEP = 1e-5, 100.0, 4.0, 2.5e-4
WEAK, SIGMAS = 0.3, 5.0
BOUNDS = DesignBounds(travel=(10.0, 90.0), rate=50.0, duration=SECONDS)
PAIRS = (
    ("backlash", "hardening_spring"), ("asymmetric_coulomb", "position_dependent_friction"),
    ("hardening_spring", "position_periodic_force"), ("sensor_lag", "actuator_lag"),
    ("actuator_hysteresis", "backlash"), ("position_dependent_friction", "load_dependent_friction"),
)  # fmt: skip
"""Effects that short recordings mistake for one another: the true one first."""
TESTS = ("proposed", *REFERENCES)


def true_valve(seed: int, effects: tuple[str, ...]) -> KnownValve:
    """The valve of a seed with what an effect adds at its usual size."""
    values, stroke = random_valve(seed)
    known = CATALOGUE.parameters(effects)
    values = {n: p.scale for n, p in known.items()} | values
    parameters = {n: Value(value=values[n], unit=p.unit, status="identified") for n, p in known.items()}
    model = ValveModel(effects=effects, parameters=parameters, plant={"stroke_m": stroke}, noise={"position_m": NOISE})
    return known_valve("truth", model)


def measured_on(valve: KnownValve, test: DrivenTest, rng: np.random.Generator) -> Recording | None:
    """What the true valve shows in a test, with noise."""
    path = valve.path(test, valve.p, valve.at_rest(float(test.force[0])))
    if path is None:
        return None
    seen = path + rng.normal(0, NOISE, len(path))
    return Recording.from_arrays(time=test.t, force=test.force, position=seen, plant=Plant(stroke_m=valve.stroke))


def short_step(valve: KnownValve) -> DrivenTest:
    """A step up and down of four seconds, after which much is not known."""
    t = np.arange(round(4 * RATE) + 1) / RATE
    drive = drive_of(valve, "force", DesignBounds(travel=(20.0, 80.0), rate=200.0, duration=4.0))
    return drive.test(t, drive.asked(t, ((t > 0.5) & (t < 2.5)).astype(float)), SUB_STEP)


def fits(recordings: list[Recording], rivals: tuple[str, ...]) -> dict[str, Identification]:
    """What `bristle fit` makes of recordings, with each of the rival effects or with none."""
    return {
        name or "valve": identify(recordings, effects=(*BASE, name) if name else BASE, check=False, order="full")
        for name in rivals or ("",)
    }


def square(found: Identification) -> float:
    """Sum of squared residuals in units of the noise that was put in."""
    return sum(float(np.nansum((one.measured - one.simulated) ** 2)) for one in found.trajectories) / NOISE**2


def case(seed: int) -> Counter[str] | None:
    """Which tests settle the case of a seed; None where there was nothing to settle."""
    rng = np.random.default_rng([seed, 29])
    pair = PAIRS[seed // 2 % len(PAIRS)] if seed % 2 else ()
    truth = true_valve(seed, (*BASE, *pair[:1]))
    first = measured_on(truth, short_step(truth), rng)
    if first is None:
        return None
    known = fits([first], pair)
    if pair and abs(square(known[pair[1]]) - square(known[pair[0]])) > SIGMAS**2:
        return None
    weak = [n for one in known.values() for n, p in one.model.parameters.items() if p.status == "weak"]
    if not weak and not pair:
        return None
    models = {name: one.model for name, one in known.items()}
    tests, promised = proposals(models)
    found: Counter[str] = Counter(cases=1, promised=promised)
    for name, test in tests.items():
        seen = measured_on(truth, test, rng)
        ends = {} if seen is None else fits([first, seen], pair)
        found += judged(name, ends, truth, pair, weak)
    found["promise kept"] = promised * found["proposed"]
    found["weak parameters"] += 0 if pair else len(weak)
    found.update({} if pair else {f"{n} weak": 1 for n in weak})
    return found


def proposals(models: Mapping[str, ValveModel]) -> tuple[dict[str, DrivenTest], bool]:
    """The tests to compare, all within the limits, as the valve gets them, and whether the proposed one is expected to
    settle the case."""
    proposed = next_test(models, BOUNDS, drive="force", sampling=RATE)
    sequences = {"proposed": proposed.sequence, **proposed.reference_sequences}
    drive = drive_of(known_valve("first", next(iter(models.values()))), "force", BOUNDS)
    return {name: drive.test(proposed.t, force, SUB_STEP) for name, force in sequences.items()}, proposed.settles


def judged(
    name: str, ends: dict[str, Identification], truth: KnownValve, pair: tuple[str, ...], weak: list[str]
) -> Counter[str]:
    """Whether a test has settled a case, and how many weak parameters it told."""
    if not ends:
        return Counter()
    if pair:
        return Counter({name: int(square(ends[pair[1]]) - square(ends[pair[0]]) > SIGMAS**2)})
    told = [n for n in weak if is_told(n, ends["valve"], truth)]
    return Counter({name: int(len(told) == len(weak)), f"{name}, parameters": len(told)}) + Counter(
        f"{n} told by {name}" for n in told
    )


def is_told(name: str, end: Identification, truth: KnownValve) -> bool:
    """Whether a parameter is known after a fit, and rightly so."""
    one, true = end.model.parameters[name], truth.values[name]
    return one.status == "identified" and abs(one.value - true) < WEAK * abs(true)


def cases(first: int, wanted: int) -> Iterator[tuple[int, Counter[str]]]:
    """As many cases as are wanted, from a seed on."""
    seed = first
    while wanted:
        try:
            found = case(seed)
        except BristleError as why:
            print(f"seed {seed}: {why}", flush=True)
            found = None
        if found is not None:
            wanted -= 1
            yield seed, found
        seed += 1


def main() -> None:
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cases", type=int, default=2)
    parser.add_argument("--first", type=int, default=100)
    given = parser.parse_args()
    total: Counter[str] = Counter()
    for seed, found in cases(given.first, given.cases):
        total += found
        kind = "class" if seed % 2 else "weak"
        promised = "expected to be settled" if found["promised"] else "not expected to be"
        print(
            f"seed {seed} ({kind}, {promised}): settled by {', '.join(n for n in TESTS if found[n]) or 'none'}",
            flush=True,
        )
    told = ", ".join(f"{n} tells {total[f'{n}, parameters']}" for n in TESTS)
    print(f"{total['weak parameters']} weak parameters: {told}")
    for n in sorted(key.removesuffix(" weak") for key in total if key.endswith(" weak")):
        print(
            f"  {n}, weak in {total[f'{n} weak']}: "
            + ", ".join(f"{name} {total[f'{n} told by {name}']}" for name in TESTS)
        )
    print(
        f"{total['promised']} were expected to be settled by the proposed test, and it settled {total['promise kept']}"
    )
    print(f"{total['cases']} cases from seed {given.first}: " + ", ".join(f"{n} settles {total[n]}" for n in TESTS))


if __name__ == "__main__":
    main()
