"""How many cases a proposed test settles, against a staircase and a sine of the same length.

    python -m benchmarks.next_test --cases 4 --first 100

A case is a seeded valve after a short step: even seeds where a parameter is weak after it, odd seeds where a rival
effect explains it as well. Then three tests are run on the true valve, with noise, and both recordings are fitted. A
weak parameter is told when its standard deviation is below 30 % and its value within 30 %; a case is settled when all
of them are, or when the rival fits worse by five sigmas. The fit is a
local one from values that are off by some percent, and fails where it ends in another minimum. Development seeds are 0
to 20.
"""

from __future__ import annotations

import argparse
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import least_squares

from identification.next_test import REFERENCES, DesignBounds, DrivenTest, KnownValve, drive_of, known_valve, next_test
from recordings import Array, BristleError
from simulator import BASE, CATALOGUE, Value, ValveModel, random_valve

NOISE, RATE, SECONDS, SUB_STEP = 1e-5, 100.0, 8.0, 1e-3
WEAK, SIGMAS = 0.3, 5.0
PAIRS = (
    ("backlash", "hardening_spring"), ("asymmetric_coulomb", "position_dependent_friction"),
    ("hardening_spring", "position_periodic_force"), ("sensor_lag", "actuator_lag"),
    ("actuator_hysteresis", "backlash"), ("position_dependent_friction", "load_dependent_friction"),
)  # fmt: skip
"""Effects that short recordings mistake for one another: the true one first."""
TESTS = ("proposed", *REFERENCES)


@dataclass(frozen=True)
class Estimated:
    """A model after a fit. square : sum of squared residuals [noise sigmas]."""

    model: ValveModel
    square: float


def model_of(effects: tuple[str, ...], values: dict[str, float], stroke: float) -> ValveModel:
    """A model of which nothing is known but its values."""
    known = CATALOGUE.parameters(effects)
    parameters = {
        n: Value(value=values[n], unit=p.unit, status="given" if p.known else "weak") for n, p in known.items()
    }
    return ValveModel(effects=effects, parameters=parameters, plant={"stroke_m": stroke}, noise={"position_m": NOISE})


def estimated(model: ValveModel, test: DrivenTest, measured: Array) -> Estimated | None:
    """A model fitted to a test, with what was known of it before as a prior."""
    valve = known_valve("fit", model)
    n, spread = len(valve.names), np.concatenate([valve.std, valve.start_std])
    start, bounds = valve.at_rest(float(test.force[0])), valve.coordinates.bounds

    def residual(unknowns: Array) -> tuple[Array, Array]:
        theta = np.clip(valve.theta + unknowns[:n] * spread[:n], bounds.lower, bounds.upper)
        s0 = start.copy()
        s0[valve.own_starts] += unknowns[n:] * spread[n:]
        path = valve.response(test, valve.coordinates.p(theta), s0)
        if path is None:
            return np.full(len(measured) + len(unknowns), 1e6), np.zeros((len(measured) + len(unknowns), len(unknowns)))
        white = (path.y - measured) / path.noise
        return np.concatenate([white, unknowns]), np.vstack(
            [path.by * spread / path.noise[:, None], np.eye(len(spread))]
        )

    end = least_squares(lambda x: residual(x)[0], np.zeros(len(spread)), lambda x: residual(x)[1], max_nfev=20)
    if not np.isfinite(end.cost):
        return None
    p = valve.coordinates.p(np.clip(valve.theta + end.x[:n] * spread[:n], bounds.lower, bounds.upper))
    inner = np.linalg.inv(end.jac.T @ end.jac)
    std = np.sqrt(np.diag(inner))[:n] * spread[:n] * np.abs(valve.coordinates.slope(p))
    values = dict(zip(valve.kernel.parameters, p.tolist(), strict=True))
    parameters = dict(model.parameters)
    for name, one in zip(valve.names, std.tolist(), strict=True):
        status = "weak" if one > WEAK * abs(values[name]) else "identified"
        parameters[name] = parameters[name].model_copy(update={"value": values[name], "std": one, "status": status})
    return Estimated(model.model_copy(update={"parameters": parameters}), 2 * float(end.cost))


def measured_on(valve: KnownValve, test: DrivenTest, rng: np.random.Generator) -> Array | None:
    """What the true valve shows in a test, with noise."""
    path = valve.path(replace(test, h_max=2.5e-4), valve.p, valve.at_rest(float(test.force[0])))
    return None if path is None else path + rng.normal(0, NOISE, len(path))


def short_step(valve: KnownValve) -> DrivenTest:
    """A step up and down of four seconds, after which much is not known."""
    t = np.arange(round(4 * RATE) + 1) / RATE
    drive = drive_of(valve, "force", DesignBounds(travel=(20.0, 80.0), rate=200.0, duration=4.0))
    return drive.test(t, drive.asked(t, ((t > 0.5) & (t < 2.5)).astype(float)), SUB_STEP)


def case(seed: int) -> Counter[str] | None:
    """Which tests settle the case of a seed; None where there was nothing to settle."""
    rng = np.random.default_rng([seed, 29])
    values, stroke = random_valve(seed)
    pair = PAIRS[seed // 2 % len(PAIRS)] if seed % 2 else ()
    true_effects = (*BASE, *pair[:1])
    values = {n: p.scale for n, p in CATALOGUE.parameters(true_effects).items()} | values
    truth = known_valve("truth", model_of(true_effects, values, stroke))
    first = short_step(truth)
    seen = measured_on(truth, first, rng)
    if seen is None:
        return None
    models = {}
    for effect in pair or ("",):
        effects = (*BASE, effect) if effect else BASE
        start = {n: p.scale / 2 for n, p in CATALOGUE.parameters(effects).items()} | values
        start = {n: x * float(np.exp(rng.normal(0, 0.1))) for n, x in start.items()}
        found = estimated(model_of(effects, start, stroke), first, seen)
        if found is None:
            return None
        models[effect or "valve"] = found
    if pair and abs(models[pair[1]].square - models[pair[0]].square) > SIGMAS**2:
        return None
    return settled({name: one.model for name, one in models.items()}, truth, pair, rng)


def settled(
    models: dict[str, ValveModel], truth: KnownValve, pair: tuple[str, ...], rng: np.random.Generator
) -> Counter[str] | None:
    """Which of the three tests settle what the models leave open."""
    weak = [n for one in models.values() for n, p in one.parameters.items() if p.status == "weak"]
    if not weak and not pair:
        return None
    bounds = DesignBounds(travel=(10.0, 90.0), rate=50.0, duration=SECONDS)
    proposed = next_test(models, bounds, drive="force", sampling=RATE)
    drive = drive_of(known_valve("first", next(iter(models.values()))), "force", bounds)
    t = proposed.t
    tests = {name: drive.test(t, drive.asked(t, wave(t / t[-1])), SUB_STEP) for name, wave in REFERENCES.items()}
    tests["proposed"] = drive.test(t, proposed.sequence, SUB_STEP)
    found: Counter[str] = Counter(cases=1, **{"promised" if proposed.settles else "not promised": 1})
    for name, test in tests.items():
        seen = measured_on(truth, test, rng)
        ends = {} if seen is None else {key: estimated(one, test, seen) for key, one in models.items()}
        known = {key: one for key, one in ends.items() if one is not None}
        if len(known) < len(models):
            continue
        if pair:
            found[name] += known[pair[1]].square - known[pair[0]].square > SIGMAS**2
            continue
        told = [n for n in weak if _is_told(n, known["valve"], truth)]
        found[name] += len(told) == len(weak)
        found[f"{name}, parameters"] += len(told)
    found["weak parameters"] += 0 if pair else len(weak)
    return found


def _is_told(name: str, end: Estimated, truth: KnownValve) -> bool:
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
        print(f"seed {seed} ({kind}): settled by {', '.join(n for n in TESTS if found[n]) or 'none'}", flush=True)
    told = ", ".join(f"{n} tells {total[f'{n}, parameters']}" for n in TESTS)
    print(f"{total['weak parameters']} weak parameters: {told}")
    print(f"{total['cases']} cases from seed {given.first}: " + ", ".join(f"{n} settles {total[n]}" for n in TESTS))


if __name__ == "__main__":
    main()
