"""What the detector costs, and how often it alarms without a reason.

python -m benchmarks.detector                  cost, published times, plant hour, an hour of every setting
python -m benchmarks.detector --hours 24       the false alarms of a day for every setting (about half an hour)
python -m benchmarks.detector --only cost      one part: cost, published, plant or alarms
python -m benchmarks.detector --only alarms --hours 24 --setting 4 --learn 1800    one setting, learned on half an hour
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from benchmarks.machine import machine
from benchmarks.measured_data import PLANT_HOUR
from benchmarks.plain_observer import PlainObserver, filterpy_filter
from detector import Calibration, Fleet, Measurements, Watch, learn
from detector.published import chapter_5, section_4_4
from recordings import Array, BadInput
from simulator.damadics import Actuator, Form, Noise, Parameters, Scenario, Stimulus, run, stimuli
from studies import chapter5, section44, ten_hertz

N_VALVES = 1000
GOAL_SINGLE, GOAL_BATCHED = 400.0, 80.0
"""Nanoseconds per step."""


@dataclass(frozen=True)
class Setting:
    """A healthy valve: friction as a play or a force, what moves it, and the sampling time [s]."""

    form: Form
    stimulus: Stimulus
    sample_s: float
    words: str


SETTINGS = (
    Setting("lugre", ten_hertz.moving, 0.1, "LuGre, to and fro, 10 Hz"),
    Setting("play", ten_hertz.moving, 0.1, "play, to and fro, 10 Hz"),
    Setting("lugre", stimuli.step_one_square, 1.0, "LuGre, Step I with squares, 1 Hz"),
    Setting("play", stimuli.step_one_square, 1.0, "play, Step I with squares, 1 Hz"),
)
LEARN_S = {0.1: 600.0, 1.0: 43200.0}
"""How much is learned from, by sampling time [s]: at 1 Hz the sines of Step I meet anew only after 12 h."""


def calibration(number: int = 0) -> Calibration:
    """A typical calibration; each number another."""
    a = 0.25 + 0.1 * (number % 7) / 7
    return Calibration(
        "setpoint", 0.0, 1.0, 0.0, 1.0, a, a, a, b1=1.0, noise=3e-3, jerk=0.03, dt_s=0.1, error=0.1, top_speed=0.1,
        e1=0.1, w1=(0.02,) * 5, w2=(0.02,) * 5,
    )  # fmt: skip


def best(work: Callable[[], object], steps: int, rounds: int = 5) -> float:
    """Nanoseconds of processor time per step, the best of some rounds."""
    found = []
    for _ in range(rounds):
        start_s = time.process_time()
        work()
        found.append((time.process_time() - start_s) / steps * 1e9)
    return min(found)


def cost() -> None:
    """One observer compiled, a fleet of them, the plain form and filterpy, all in this run."""
    one, n = calibration(), 100_000
    t = 0.1 * np.arange(n)
    random = np.random.default_rng(0)
    x, u = 0.4 * np.sin(t / 5) + 3e-3 * random.normal(size=n), 0.4 * np.sin(t / 5)
    observer = one.compiled
    observer.run(observer.initial(), t[:10], x[:10], u[:10])
    single = best(lambda: observer.run(observer.initial(), t, x, u), n)
    regular, jittered = (_fleet(x, u, jitter) for jitter in (0.0, 0.02))
    plain, filter = PlainObserver(one), filterpy_filter(0.1)
    pairs = list(zip(x[:2000].tolist(), u[:2000].tolist(), strict=True))
    numpy_ns = best(lambda: [plain.step(*pair) for pair in pairs], len(pairs), 3)
    filterpy_ns = best(lambda: [(filter.predict(), filter.update(a)) for a, _ in pairs], len(pairs), 3)
    print(f"one observer, compiled         {single:9.0f} ns a step   goal {GOAL_SINGLE:.0f}")
    print(f"{N_VALVES} valves, regular samples  {regular:9.0f} ns a step   goal {GOAL_BATCHED:.0f}")
    print(f"{N_VALVES} valves, jittered samples {jittered:9.0f} ns a step")
    for name, value in (("plain numpy form", numpy_ns), ("filterpy, predict and update", filterpy_ns)):
        print(f"{name:30} {value:9.0f} ns a step   {value / single:.0f} x single, {value / regular:.0f} x batched")
    whole = _whole_watch() / 1000.0
    print(f"whole watch, all its parts     {whole:9.0f} us a sample   {whole / 100.0:.1f} % of a core at 100 Hz")


def _whole_watch() -> float:
    """Nanoseconds a sample of observer, positioner, model of a fit, flow and levels."""
    data = ten_hertz.seen(ten_hertz.moving, 160.0, 1)
    watch, rows = learn(data, ten_hertz.fitted()), list(data)

    def work() -> None:
        state = watch.initial()
        for row in rows:
            state, _ = watch.step(state, row)

    work()
    return best(work, len(rows))


def _fleet(x: Array, u: Array, jitter: float) -> float:
    """Nanoseconds per valve and step."""
    fleet, rounds = Fleet([calibration(i) for i in range(N_VALVES)]), 300
    random = np.random.default_rng(1)
    times = 0.1 * np.arange(1, rounds + 1)[:, None] + jitter * random.uniform(-1.0, 1.0, (rounds, N_VALVES))
    columns = [(times[k], np.full(N_VALVES, x[k]), np.full(N_VALVES, u[k])) for k in range(rounds)]

    def work() -> None:
        state = fleet.initial()
        for row in columns:
            state, _ = fleet.step(state, *row)

    work()
    return best(work, rounds * N_VALVES)


def published() -> None:
    """The published times and ours: Section 4.4 as times of its condition, Chapter 5 as alarms."""
    before, state, _ = section44.learned(section_4_4())
    for fault, printed in section44.PUBLISHED.items():
        holds = section44.seconds(section44.detect(before, state, fault).holds_s)
        print(f"Section 4.4 {fault}: printed {printed} s, condition (4.32) holds at {holds} s")
    for name, expected in chapter5.PUBLISHED.items():
        found = chapter5.decided(chapter_5(), chapter5.recorded(name)).first_alarm(5.0)
        print(f"Chapter 5 {name}: expected {expected:.4f} s, alarm at {found:.4f} s")


def plant() -> None:
    """The hour of a real valve, learned on its first third."""
    if not PLANT_HOUR.exists():
        print(f"plant hour: {PLANT_HOUR} is not there")
        return
    import scipy.io

    t, p1, p2, _, flow, cv, x = scipy.io.loadmat(PLANT_HOUR)["OneHourTestData_ExampleII"][:7].astype(float)
    names = ("position", "setpoint", "upstream_pressure", "downstream_pressure", "mass_flow")
    data = Measurements(t, dict(zip(names, (3.81e-4 * x, cv / 100, 1e3 * p1, 1e3 * p2, flow / 3.6), strict=True)))
    third = len(data) // 3
    watch = learn(data[:third])
    alarms, load = watched(watch, data[third:])
    print(f"plant hour: {alarms} alarms in the other two thirds, highest score {load.max():.2f} of the limit")
    print(f"  {watch.false_alarms.sentence}")


def watched(watch: Watch, data: Measurements) -> tuple[int, Array]:
    """Alarms and scores (n_samples,) of a run."""
    judgements = watch.run(watch.initial(), data)[1]
    return sum(one.began for one in judgements), np.array([one.load for one in judgements])


def healthy(setting: Setting, hours: float) -> Measurements:
    """A healthy valve, in pieces of an hour without the first half minute, in which the chamber fills.

    The published form is not the same valve all day: it integrates the pressure and the mass of the air in the chamber
    beside each other, the mass runs away, and by the evening a stroke is a sixth shorter.
    """
    parts = list[Measurements]()
    for k in range(max(round(hours), 1)):
        begin = 3600.0 * k

        def stimulus(t: Array, begin: float = begin) -> Array:
            return setting.stimulus(t + begin)

        seconds = 3600.0 * min(hours, 1.0)
        scenario = Scenario("healthy", setting.words, stimulus, seconds, (), setting.sample_s)
        actuator = Actuator(setting.form, Parameters(), {})
        recording, _ = run(scenario, actuator, Noise(11 + k), duration=seconds, sample=setting.sample_s)
        parts.append(Measurements.recorded(recording)[round(30 / setting.sample_s) :])
    times = np.concatenate([part.time_s + 3600.0 * k for k, part in enumerate(parts)])
    return Measurements(
        times, {name: np.concatenate([part.values[name] for part in parts]) for name in parts[0].values}
    )


def false_alarms(hours: float, only: int | None, learn_s: float | None) -> None:
    """A healthy day, noise on, for every setting: alarms seen, and what was promised."""
    print(f"false alarms without a fault, noise on, {hours:g} h simulated per setting; goal: below 1 a month")
    for setting in SETTINGS if only is None else SETTINGS[only - 1 : only]:
        data, learning = healthy(setting, hours), learn_s or LEARN_S[setting.sample_s]
        learned = round(learning / setting.sample_s)
        start_s = time.process_time()
        try:
            watch = learn(data[:learned], ten_hertz.fitted(setting.form))
        except BadInput as refusal:
            print(f"  {setting.words}, learned on {learning:.0f} s: {refusal}", flush=True)
            continue
        alarms, load = watched(watch, data[learned:])
        print(
            f"  {setting.words}: {alarms} alarms in {len(load) * setting.sample_s / 3600:.1f} h, highest score "
            f"{load.max():.2f} of the limit; learned on {learning:.0f} s: {watch.false_alarms.sentence}; "
            f"{time.process_time() - start_s:.0f} s of processor",
            flush=True,
        )


def main() -> None:
    """Print what was asked for."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--hours", type=float, default=1.0, help="simulated hours per setting")
    parser.add_argument("--only", choices=("cost", "published", "plant", "alarms"))
    parser.add_argument("--setting", type=int, choices=range(1, len(SETTINGS) + 1), help="one of the settings")
    parser.add_argument("--learn", type=float, help="seconds that are learned from")
    chosen = parser.parse_args()
    parts: dict[str, Callable[[], None]] = {
        "cost": cost, "published": published, "plant": plant,
        "alarms": lambda: false_alarms(chosen.hours, chosen.setting, chosen.learn),
    }  # fmt: skip
    print(machine("numpy", "numba", "filterpy"))
    for name, part in parts.items():
        if chosen.only in (None, name):
            part()


if __name__ == "__main__":
    main()
