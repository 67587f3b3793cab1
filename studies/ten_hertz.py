"""What the detector sees of each fault of the benchmark at 10 Hz, and what it cannot. Run: python -m studies.ten_hertz

Its model is fitted to two minutes of a recording, and the detector learned on 390 s of another, in motion, the
benchmark's noise on, friction as a force. Then every fault comes at
60 s, once while the valve moves and once while the set point has stood still for 20 s. The names are counted on other
seeds, which were not looked at before.
"""

from __future__ import annotations

from collections import Counter
from functools import lru_cache

import numpy as np

from detector import Judgement, Measurements, Watch, learn
from identification import identify
from recordings import Array, Recording
from simulator import ValveModel
from simulator.damadics import FAULTS, Actuator, Fault, Form, Noise, Parameters, Scenario, Stimulus, run, stimuli
from studies import drawing

SAMPLE_S, ONSET_S, AFTER_S, FILLED_S, FITTED_S = 0.1, 60.0, 60.0, 10.0, 130.0
FITTED_TO = ("time", "position", "pressure")
LEVELS = {"small": 0.25, "big": 0.75}
NAMED_SEEDS = (9201, 9202, 9203)
"""1 to 22 were used for development."""

DUE = {
    **dict.fromkeys((2, 3, 5, 6, 7, 17, 18, 19), "flow"), 4: "friction", **dict.fromkeys((10, 11), "spring"),
    **dict.fromkeys((13, 14), "sensor"), 16: "supply",
}  # fmt: skip
"""Kind by fault; for the others unknown is right. The kind spring is that of the diaphragm, too."""

NAMES_HEAD = ("", "fault", "due", "right", "right among those that remain", "unknown", "wrong", "not seen")

HEAD = ("", "fault", "strength", "in motion [s]", "named", "at rest [s]", "named")


NAMES_NOTE = (
    "Faults in motion, both strengths, seeds "
    f"{', '.join(map(str, NAMED_SEEDS))}, which nobody had looked at: the name a minute after the onset. *Right*: the "
    "kind that is due; without one, no name. *Among those that remain*: the event says two kinds, and this is one."
)


def moving(t: Array) -> Array:
    """Set point to and fro, everything else constant."""
    columns = stimuli.constant(0.5)(t)
    columns[:, 0] = 0.55 + 0.15 * np.sin(2 * np.pi * t / 20.0) + 0.08 * np.sin(2 * np.pi * t / 47.0)
    return columns


def resting(t: Array) -> Array:
    """The same until 40 s, then the set point stands still."""
    return moving(np.minimum(t, ONSET_S - 20.0))


def seen(stimulus: Stimulus, duration: float, seed: int, *faults: Fault) -> Measurements:
    """What the detector gets of a run, once the chamber is full."""
    scenario = Scenario("ten hertz", "to and fro", stimulus, duration, faults, SAMPLE_S)
    recording, _ = run(scenario, Actuator("lugre", Parameters(), {}), Noise(seed), duration=duration, sample=SAMPLE_S)
    return Measurements.recorded(recording)[round(FILLED_S / SAMPLE_S) :]


@lru_cache
def fitted(form: Form = "lugre") -> ValveModel:
    """The valve as `bristle fit` finds it from two minutes of another recording at the same sampling."""
    scenario = Scenario("commissioning", "to and fro", moving, FITTED_S, (), SAMPLE_S)
    recording, _ = run(scenario, Actuator(form, Parameters(), {}), Noise(3), duration=FITTED_S, sample=SAMPLE_S)
    signals = {name: recording.si(name).values[round(FILLED_S / SAMPLE_S) :] for name in FITTED_TO}
    return identify([Recording.from_arrays(**signals, plant=recording.plant, source="simulated")], check=False).model


def changes(watch: Watch, data: Measurements) -> list[Judgement]:
    """The judgements at which an alarm began or got another name."""
    return [one for one in watch.run(watch.initial(), data)[1] if one.began or one.renamed]


def outcome(watch: Watch, stimulus: Stimulus, fault: Fault) -> tuple[str, str]:
    """Seconds from the onset to the alarm, and the name that it ends with; dashes for none within a minute."""
    found = changes(watch, seen(stimulus, ONSET_S + AFTER_S, 7, fault))
    if any(said.time_s < ONSET_S for said in found):
        return "false alarm", ""
    if not found:
        return "-", "-"
    return f"{found[0].time_s - ONSET_S:.1f}", found[-1].kind or " or ".join(found[-1].remaining) or "unknown"


def name_of(found: list[Judgement], due: str | None) -> str:
    """In which column of `NAMES_HEAD` the name belongs that an alarm has in the end."""
    if not found:
        return "not seen"
    kind, remaining = found[-1].kind, found[-1].remaining
    if kind is not None:
        return "right" if kind == due else "wrong"
    if due is None:
        return "right"
    return "unknown" if not remaining else "right among those that remain" if due in remaining else "wrong"


def names(watch: Watch) -> list[list[str]]:
    """A line for each fault: how many runs, in motion, of both strengths and all seeds, end with which name."""
    lines = []
    for number, kind in FAULTS.items():
        due, count = DUE.get(number), Counter[str]()
        for seed in NAMED_SEEDS:
            for strength in LEVELS.values():
                data = seen(moving, ONSET_S + AFTER_S, seed, Fault(number, strength, start_s=ONSET_S))
                count[name_of([one for one in changes(watch, data) if one.time_s >= ONSET_S], due)] += 1
        lines.append([f"f{number}", kind.name, due or "unknown", *(str(count[column]) for column in NAMES_HEAD[3:])])
        print(*lines[-1], sep=" | ", flush=True)
    total = [str(sum(int(line[column]) for line in lines)) for column in range(3, len(NAMES_HEAD))]
    return [*lines, ["", "all", "", *total]]


def quiet(watch: Watch) -> str:
    """What comes of the same runs without a fault."""
    count = sum(len(changes(watch, seen(stimulus, 400.0, 8))) for stimulus in (moving, resting))
    return f"{count or 'no'} alarms in 390 s of motion and 390 s that end in rest"


def rows(watch: Watch) -> list[list[str]]:
    """A line of the table for each fault and strength."""
    lines = []
    for number, kind in FAULTS.items():
        for level, strength in LEVELS.items():
            fault = Fault(number, strength, start_s=ONSET_S)
            cells = [cell for stimulus in (moving, resting) for cell in outcome(watch, stimulus, fault)]
            lines.append([f"f{number}", kind.name, f"{level}, {strength:g}", *cells])
            print(*lines[-1], sep=" | ", flush=True)
    return lines


def main() -> None:
    """Write docs/studies/ten_hertz.md."""
    watch = learn(seen(moving, 400.0, 1), fitted())
    note = (
        "Benchmark actuator with LuGre friction and the benchmark's noise, a sample every 0.1 s; the model is that of "
        "a fit to two minutes of a recording, the detector learned on 390 s of another. Each fault is abrupt and comes "
        "once while the valve moves, once 20 s after the set point came to rest: seconds to the alarm, and the name it "
        "has a minute after the onset. A dash: not seen in that minute. "
        f"Without a fault: {quiet(watch)}.\n\nMade by `python -m studies.ten_hertz`; {watch.false_alarms.sentence}."
    )
    drawing.page("ten_hertz", "What can be seen at 10 Hz", HEAD, rows(watch), note)
    with (drawing.FOLDER / "ten_hertz.md").open("a", encoding="utf-8") as page:
        page.write("\n".join(["", "## Names", "", NAMES_NOTE, "", *drawing.rows_of(NAMES_HEAD, names(watch)), ""]))


if __name__ == "__main__":
    main()
