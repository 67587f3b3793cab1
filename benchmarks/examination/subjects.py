"""The subjects of the examination. Each draws a case and returns a row: what was asked, what was answered, how right
it is."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import numpy as np

import bristle as br
from benchmarks import emps_scoring, real
from benchmarks.examination import draws, process
from benchmarks.examination.plant import Valve, run
from identification import one_thread
from recordings import BadInput, NegativeAnswer, Recording

Row = dict[str, Any]
RATES = (50.0, 100.0, 200.0)
TRUTH = {
    "mass.m": "m", "spring.K": "K", "spring.F0": "F0", "lugre.fc": "fc", "lugre.fs": "fs", "lugre.vs": "vs",
    "lugre.sigma0": "sigma0", "lugre.sigma1": "sigma1", "lugre.sigma2": "sigma2",
}  # fmt: skip
HALF_95 = 1.96
"""Half of a 95 % interval of a normal distribution, in standard deviations."""
TRACE_BUDGET_S = 120.0
"""As `bristle trace` has it when nothing is said; here with one thread."""
LEARNED_S, HEALTHY_S, WORN_S = 600.0, 1800.0, 600.0
WATCHED_HZ = 20.0
WISH = 30.0
"""False alarms a month that the monitor is allowed."""
CAUSES = ("stiction", "tuning", "disturbance")


def fit(rng: np.random.Generator, case: int) -> Row:
    """Relative errors of all parameters, and which of the 95 % intervals that the model states hold the truth."""
    valve, rate = draws.valve(rng), float(rng.choice(RATES))
    recordings, judging = draws.experiments(valve, rate, rng)
    found = br.fit(recordings, holdout=judging, crosscheck=False)
    truth = {name: float(getattr(valve, field)) for name, field in TRUTH.items()}
    stated = {name: found.model.parameters[name] for name in truth}
    errors = {name: stated[name].value / true - 1.0 for name, true in truth.items()}
    holds = {
        name: bool(abs(one.value - truth[name]) <= HALF_95 * one.std)
        for name, one in stated.items()
        if one.std is not None
    }
    return {
        "asked": f"{rate:g} Hz", "converged": bool(found.converged), "errors": errors, "holds": holds,
        "status": {name: str(one.status) for name, one in stated.items()},
    }  # fmt: skip


def trace(rng: np.random.Generator, case: int) -> Row:
    """The name of the effect: right, wrong, or a miss (`none` or `unlisted` where an effect of the catalogue is)."""
    effect = draws.TRACED[case % len(draws.TRACED)]
    valve = draws.EFFECTS[effect](draws.valve(rng), rng)
    recordings, judging = draws.experiments(valve, 100.0, rng)
    found = br.trace(recordings, holdout=judging, budget=TRACE_BUDGET_S)
    due = "unlisted" if effect in draws.UNLISTED else effect
    return {
        "asked": effect, "answered": found.verdict, "complete": bool(found.complete),
        "score": scored(due, found.verdict, found.same_class),
    }  # fmt: skip


def scored(due: str, verdict: str, same_class: tuple[str, ...] = ()) -> str:
    """``right``, ``miss`` or ``wrong``."""
    if verdict == due or due in same_class:
        return "right"
    return "miss" if verdict in ("none", "unlisted") and due != "none" else "wrong"


def monitor(rng: np.random.Generator, case: int) -> Row:
    """Alarms on a healthy valve, and how long grown friction stays unseen. The model is fitted, as a user would."""
    valve = draws.valve(rng)
    model = br.fit(draws.experiments(valve, 100.0, rng)[0], crosscheck=False).model
    worn = float(rng.uniform(0.3, 1.0))
    ageing = valve._replace(worn=worn, worn_at=HEALTHY_S)
    watch = br.learn(service(valve, LEARNED_S, rng), model, false_alarms=WISH)
    seen = br.watch(service(ageing, HEALTHY_S + WORN_S, rng), watch)
    at = np.array([one.time_s for one in seen.alarms])
    after = at[at >= HEALTHY_S]
    standing = bool(seen.alarm[seen.time_s < HEALTHY_S][-1])
    delay = float(after[0] - HEALTHY_S) if len(after) and not standing else None
    return {
        "asked": f"friction +{100 * worn:.0f} %", "false_alarms": int(np.sum(at < HEALTHY_S)),
        "promised": HEALTHY_S / watch.false_alarms.interval_s, "standing": standing, "delay_s": delay,
        "kinds": sorted({str(one.kind) for one in seen.alarms if one.time_s >= HEALTHY_S}),
    }  # fmt: skip


def service(valve: Valve, seconds: float, rng: np.random.Generator) -> Recording:
    """A recording of a valve that its positioner moves from one random set point to the next."""
    course = draws.setpoint(valve.stroke, seconds, "service", rng)
    return draws.measured(valve, run(valve, course, rng), WATCHED_HZ, rng)


def assess(rng: np.random.Generator, case: int) -> Row:
    """Whether a sticking valve, a controller or a disturbance makes a loop swing."""
    cause = str(rng.choice(CAUSES, p=(0.5, 0.25, 0.25)))
    signals = dict(zip(("SP", "PV", "OP"), process.loop(draws.valve(rng), cause, 2400, rng).T, strict=True))
    time_s = process.SCAN_S * np.arange(2400)
    recording = br.Recording.from_arrays(time=time_s, extra=signals, units=dict.fromkeys(signals, "%"))
    found = br.assess(recording, loop="flow")
    due = "stiction" if cause == "stiction" else "no_stiction"
    score = "cannot tell" if found.verdict == "cannot_tell" else "right" if found.verdict == due else "wrong"
    return {"asked": cause, "answered": found.verdict, "score": score}


def emps(rng: np.random.Generator, case: int) -> Row:
    """EMPS with its official split, scored as its authors do; nothing is drawn."""
    found = real.EMPS.traced()
    fitted, official = (emps_scoring.measured(name) for name in (emps_scoring.FITTED, emps_scoring.OFFICIAL))
    return {
        "asked": "DATA_EMPS to DATA_EMPS_PULSES", "answered": ", ".join(found.effects_added) or found.verdict,
        "fitted": emps_scoring.model_error(found.final, fitted),
        "official": emps_scoring.model_error(found.final, official),
    }  # fmt: skip


SUBJECTS: dict[str, Callable[[np.random.Generator, int], Row]] = {
    "fit": fit, "trace": trace, "monitor": monitor, "assess": assess, "emps": emps,
}  # fmt: skip


def examine(subject: str, case: int, seed: int) -> Row:
    """One case of a sealed examination, in one thread: another core has a case of its own. A refusal or an exception is
    an answer, too: the row has ``failed``.
    """
    rng = np.random.default_rng([seed, case, list(SUBJECTS).index(subject)])
    started = time.process_time()
    row: Row = {"subject": subject, "case": case, "seed": seed}
    try:
        with one_thread():
            row |= SUBJECTS[subject](rng, case)
    except (BadInput, NegativeAnswer) as refusal:
        row |= {"failed": f"refused: {refusal}"}
    except Exception as error:
        row |= {"failed": f"{type(error).__name__}: {error}"}
    return row | {"processor_s": round(time.process_time() - started, 1)}
