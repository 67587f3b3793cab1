"""From recordings to a watch: a model that `fit` or `trace` finds, on a valve in service.

    python -m benchmarks.fit_then_watch --seed 1 --cases 2                     seeds of development
    python -m benchmarks.fit_then_watch --seed 20000 --cases 3     as reported

A valve of the examination's plant is recorded twice for a minute at 100 Hz, and its model fitted, or traced where it
has an effect beside the base ones. Then it is in service behind its positioner at 20 Hz: ten minutes are learned, half
an hour is healthy, and its friction grows. Three watches see the same: with the model, from the model alone, and with
the base model of `fit` where an effect was traced.
"""

from __future__ import annotations

import argparse
import time

import numpy as np

import bristle as br
from benchmarks.examination import draws
from benchmarks.examination.subjects import HEALTHY_S, LEARNED_S, WATCHED_HZ, WISH, WORN_S, service
from benchmarks.machine import machine
from detector import Watch, learn_model
from recordings import BadInput, Recording
from simulator import ValveModel

TRACE_BUDGET_S = 120.0
HEAD = "seed | valve | model | watch | false alarms in 0.5 h | friction grown by | seen after [s] | named"


def models(effect: str, recordings: list[Recording]) -> dict[str, ValveModel]:
    """The models of a valve by the command that finds them."""
    found = {"fit": br.fit(recordings, crosscheck=False).model}
    if effect != "none":
        traced = br.trace(recordings, budget=TRACE_BUDGET_S)
        found[f"trace: {', '.join(traced.effects_added) or traced.verdict}"] = traced.model
    return found


def seen(watch: Watch, data: Recording) -> str:
    """False alarms, and delay and last name of the grown friction."""
    found = br.watch(data, watch)
    false = sum(one.time_s < HEALTHY_S for one in found.alarms)
    after = [one for one in found.changes if one.time_s >= HEALTHY_S and not one.ended]
    standing = any(one.alarm for one in found.judgements if HEALTHY_S - 1.0 < one.time_s < HEALTHY_S)
    delay = "alarm before" if standing else f"{after[0].time_s - HEALTHY_S:.1f}" if after else "not seen"
    named = (after[-1].kind or " or ".join(after[-1].remaining) or "unknown") if after else "-"
    return f"{false} | {{worn}} | {delay} | {named}"


def case(effect: str, seed: int) -> None:
    """A row for each watch of a valve."""
    rng = np.random.default_rng(seed)
    valve = draws.EFFECTS[effect](draws.valve(rng), rng)
    recordings = draws.experiments(valve, 100.0, rng)[0]
    worn = float(rng.uniform(0.3, 1.0))
    learned = service(valve, LEARNED_S, rng)
    data = service(valve._replace(worn=worn, worn_at=HEALTHY_S), HEALTHY_S + WORN_S, rng)
    signals = {"position", "pressure"}
    for name, model in models(effect, recordings).items():
        watches = {
            "learned 10 min": lambda model=model: br.learn(learned, model, false_alarms=WISH),
            "model alone": lambda model=model: learn_model(model, 1.0 / WATCHED_HZ, signals, WISH),
        }
        for how, make in watches.items():
            try:
                said = seen(make(), data).format(worn=f"{100 * worn:.0f} %")
            except BadInput as refusal:
                said = f"refused: {refusal}"
            print(f"{seed} | {effect} | {name} | {how} | {said}", flush=True)


def main() -> None:
    """Print a table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seed", type=int, default=1, help="of the first valve; below 1000: of development")
    parser.add_argument("--cases", type=int, default=1, help="valves for each effect")
    parser.add_argument("--effect", choices=draws.EFFECTS, action="append", help="beside the base ones")
    chosen = parser.parse_args()
    print(machine("numpy", "numba", "casadi"))
    print(HEAD)
    started = time.process_time()
    for effect in chosen.effect or ("none",):
        for seed in range(chosen.seed, chosen.seed + chosen.cases):
            try:
                case(effect, seed)
            except BadInput as refusal:
                print(f"{seed} | {effect} | no recording: {refusal}", flush=True)
    print(f"{(time.process_time() - started) / 60.0:.1f} minutes of processor time")


if __name__ == "__main__":
    main()
