"""Control loops from SP, PV and OP: simulated ones whose cause is known, data that cannot tell, and refusals."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import bristle as br
from benchmarks.measured_data import DATA
from identification.loops import (
    HOW,
    STROKE,
    Assessment,
    SimulatedLoop,
    as_kept,
    assess_loop,
    compressed,
    interpolated,
    loop_of,
    quantised,
    read_loop,
    simulated_loop,
    told_by_place,
)

STICKY = [(6001, "flow"), (6003, "level"), (6003, "temperature"), (6004, "flow"), (6005, "pressure")]
OTHERS = [(6011, "tuning"), (6012, "disturbance"), (6013, "disturbance"), (6014, "tuning"), (6015, "noise")]
REFINERY = DATA / "loops" / "refinery"


@cache
def assessed(seed: int, cause: str | None = None, kind: str | None = None) -> tuple[SimulatedLoop, Assessment]:
    known = simulated_loop(seed, cause, kind, "kano")
    return known, assess_loop(known.loop)


def test_sticky_valves_are_found_with_their_s_on_fresh_seeds():
    found = [assessed(seed, "stiction", kind) for seed, kind in STICKY]
    assert sum(answer.verdict == "stiction" for _, answer in found) >= 4
    assert all(answer.verdict != "no_stiction" for _, answer in found)
    told = [(known, answer.amount) for known, answer in found if answer.amount]
    assert sum(amount.s.lower <= known.s <= amount.s.upper for known, amount in told) >= len(told) - 1


@pytest.mark.parametrize(("seed", "cause"), OTHERS)
def test_other_causes_are_not_called_stiction_on_fresh_seeds(seed, cause):
    _, answer = assessed(seed, cause)
    assert answer.verdict != "stiction"
    assert answer.amount is None


def test_probabilities_add_to_one():
    _, answer = assessed(6001, "stiction", "flow")
    assert answer.probability + sum(one.probability for one in answer.other_causes.values()) == pytest.approx(1.0)


def test_another_cause_has_the_evidence_that_speaks_for_it():
    _, answer = assessed(6012, "disturbance", "flow")
    likely, one = next(iter(answer.other_causes.items()))
    assert likely == "disturbance"
    assert 1 <= len(one.evidence) <= 2
    assert f"for disturbance: {', '.join(one.evidence)}" in answer.lines()
    loop = assessed(6012, "disturbance", "flow")[0].loop
    at_an_end = replace(loop, op=np.clip(loop.op, *np.quantile(loop.op, (0.0, 0.8))))
    assert any("20 % of the samples" in words for words in assess_loop(at_an_end).other_causes["saturation"].evidence)


def test_a_dead_band_of_the_historian_makes_the_answer_cannot_tell():
    known, answer = assessed(6001, "stiction", "flow")
    assert answer.verdict == "stiction"
    noise = float(np.median(np.abs(np.diff(known.loop.pv, 2)))) / 0.6745 / np.sqrt(6)
    kept = assess_loop(compressed(known.loop, max(2.0 * noise, 0.3 * float(np.std(known.loop.pv)))))
    assert kept.verdict == "cannot_tell"
    assert kept.probability is None
    assert "repeat the one before" in kept.why


def test_interpolated_data_are_seen():
    known, _ = assessed(6001, "stiction", "flow")
    n = len(known.loop.pv)
    straight = np.interp(np.arange(n), np.arange(0, n, 6), known.loop.pv[::6])
    assert "interpolated" in assess_loop(replace(known.loop, pv=straight)).why


def test_a_level_that_runs_straight_while_the_valve_sticks_is_not_called_compressed():
    known, _ = assessed(6003, "stiction", "level")
    t = np.arange(3000.0)
    pv = np.abs((t / 100) % 2 - 1)  # the level between two positions of the valve
    op = -2.0 * pv - np.cumsum(pv - 0.5) / 30
    clean = assess_loop(replace(known.loop, pv=pv, op=op, sp=np.full(3000, 0.5)))
    assert not any("compressed" in one.words for one in clean.problems)
    kept = assess_loop(replace(known.loop, pv=pv, op=op + np.random.default_rng(1).normal(0, 0.01, 3000), sp=None))
    assert any("interpolated" in one.words for one in kept.problems)


def test_too_few_cycles_and_too_few_samples_a_cycle_are_said():
    known, answer = assessed(6001, "stiction", "flow")
    loop, period = known.loop, int(answer.oscillations[0].period_s / known.loop.dt)
    few = slice(0, max(61, 6 * period))
    short = assess_loop(replace(loop, pv=loop.pv[few], op=loop.op[few], sp=loop.sp[few]))
    assert short.verdict in ("stiction", "cannot_tell")  # the search may find stiction, and never excludes it
    assert "cycles are fewer than ten" in short.why
    t = np.arange(3000.0)
    fast = loop_of("fast", t, None, np.sin(2 * np.pi * t / 6.1), np.cos(2 * np.pi * t / 6.1), True, "flow")
    assert "samples a cycle" in assess_loop(fast).why


def test_few_cycles_of_other_causes_are_never_called_healthy():
    known, answer = assessed(6012, "disturbance", "flow")
    assert answer.verdict == "no_stiction"
    few = slice(0, int(6 * answer.oscillations[0].period_s / known.loop.dt))
    short = assess_loop(replace(known.loop, pv=known.loop.pv[few], op=known.loop.op[few], sp=known.loop.sp[few]))
    assert short.verdict == "cannot_tell"
    assert short.probability is None


def test_a_stick_band_that_op_hardly_leaves_is_found_from_any_first_sample():
    """Where a valve stood at the first sample is not known, and it would never be seen from a wrong start."""
    known, _ = assessed(6004, "stiction", "flow")
    for first in (0, 7, 13):
        loop = replace(known.loop, pv=known.loop.pv[first:], op=known.loop.op[first:], sp=known.loop.sp[first:])
        amount = assess_loop(loop).amount
        assert amount is not None
        assert amount.s.value == pytest.approx(known.s, rel=0.05)


def test_oscillations_have_their_periods_and_noise_has_none():
    t, rng = np.arange(4000.0), np.random.default_rng(5)
    pv = np.sin(2 * np.pi * t / 40) + 0.8 * np.sin(2 * np.pi * t / 171) + rng.normal(0, 0.3, 4000)
    found = assess_loop(loop_of("two", t, None, pv, rng.normal(0, 1, 4000), True, "flow")).oscillations
    assert sorted(round(one.period_s) for one in found) == [pytest.approx(40, abs=1), pytest.approx(171, abs=4)]
    quiet = assess_loop(loop_of("noise", t, None, rng.normal(0, 1, 4000), rng.normal(0, 1, 4000), True, "flow"))
    assert quiet.verdict == "cannot_tell"


def test_methods_say_where_they_do_not_apply():
    level = {one.method: one.says for one in assessed(6003, "stiction", "level")[1].answers}
    assert {name for name, says in level.items() if says == "not applicable"} == {
        "cross-correlation", "yamashita", "relay-fit", "area-ratio", "parallelogram",
    }  # fmt: skip
    flow = {one.method: one.says for one in assessed(6001, "stiction", "flow")[1].answers}
    assert len(flow) == 8
    assert "not applicable" not in flow.values()


def sines(n: int = 400, **changes: object) -> dict[str, np.ndarray]:
    t = np.arange(float(n))
    columns = {"t": t, "sp": np.zeros(n), "pv": np.sin(t / 5), "op": np.cos(t / 5)}
    return columns | changes


BACK = np.concatenate([np.arange(200.0), np.arange(150.0, 350.0)])
MIXED = np.cumsum(np.where(np.arange(400) % 2, 1.0, 1.37))


@pytest.mark.parametrize(
    ("columns", "said"),
    [
        (sines(op=np.full(400, 30.0)), "OP never changes"),
        (sines(sp=np.sin(np.arange(400.0) / 5)), "copy of the set point"),
        (sines(op=np.sin(np.arange(400.0) / 5)), "copy of OP"),
        (sines(t=BACK), "runs backwards"),
        (sines(t=MIXED), "sampling is mixed"),
        (sines(40), "give at least 60"),
    ],
)
def test_what_cannot_be_judged_is_refused_in_words(columns, said):
    with pytest.raises(br.BadInput, match=said):
        loop_of("loop.csv", columns["t"], columns["sp"], columns["pv"], columns["op"], True, None)


def csv(folder, head: str, loop, stamps: bool = False):
    times = [str(k) for k in range(len(loop.pv))]
    if stamps:
        start = np.datetime64("2024-06-13T21:00:00")
        times = [str(start + np.timedelta64(k, "s")) for k in range(len(loop.pv))]
    rows = [f"{t},{sp},{pv},{op}" for t, sp, pv, op in zip(times, loop.sp, loop.pv, loop.op, strict=True)]
    file = folder / "FIC-211.csv"
    file.write_text("\n".join([head, *rows]) + "\n")
    return file


def test_a_file_of_a_historian_is_read_with_its_dates_and_its_tag(tmp_path):
    known, _ = assessed(6001, "stiction", "flow")
    loop, said = read_loop(csv(tmp_path, "time,SP,PV,OP [%]", known.loop, stamps=True))
    assert (loop.kind, loop.op_percent, len(loop.pv), loop.dt) == ("flow", True, len(known.loop.pv), 1.0)
    assert any("says that it is a flow loop" in words for words in said)


@pytest.mark.parametrize("columns", [None, {"TIME": "Date+Time"}])
def test_dates_and_times_of_day_may_stand_in_two_columns(tmp_path, columns):
    known, _ = assessed(6001, "stiction", "flow")
    file = csv(tmp_path, "time,SP,PV,OP [%]", known.loop, stamps=True)
    rows = file.read_text().splitlines()
    file.write_text("\n".join(["Date,Time,SP,PV,OP [%]", *(row.replace("T", ",", 1) for row in rows[1:])]) + "\n")
    loop, _ = read_loop(file, "flow", columns)
    assert (loop.dt, len(loop.pv)) == (1.0, len(known.loop.pv))


def test_columns_are_named_and_missing_units_are_said(tmp_path):
    known, _ = assessed(6001, "stiction", "flow")
    file = csv(tmp_path, "clock,a,b,c", known.loop)
    with pytest.raises(br.BadInput, match="which column is PV"):
        read_loop(file)
    names = {"SP": "a", "PV": "b", "OP": "c", "TIME": "clock:s"}
    assert any("OP has no unit" in words for words in read_loop(file, columns=names)[1])
    assert read_loop(file, columns=names | {"OP": "c:%"})[0].op_percent
    with pytest.raises(br.BadInput, match="use flow, pressure"):
        read_loop(file, "speed", names)


def test_the_answer_is_plain_json_and_a_page(tmp_path):
    _, answer = assessed(6001, "stiction", "flow")
    answer.write(tmp_path / "a.json")
    answer.report(tmp_path / "a.html")
    content = json.loads((tmp_path / "a.json").read_text())
    assert (content["format"], content["version"], content["verdict"]) == ("loop-assessment", 1, "stiction")
    assert set(content["stiction"]) == {"S_percent", "J_percent"}
    assert set(content["methods"][0]) == {"method", "value", "says", "why"}
    assert content["data"]["cycles"] > 10
    assert "stiction" in (tmp_path / "a.html").read_text()


@pytest.mark.skipif(not REFINERY.is_dir(), reason=f"no measured loops in {REFINERY}")
def test_a_measured_sticky_loop_is_not_called_healthy():
    file = REFINERY / "2111FIC46005_0614_0003.txt.gz"
    table = np.genfromtxt(file, skip_header=5, delimiter="\t", usecols=(1, 2, 3))
    loop = loop_of(file.name, np.arange(len(table)) * 10.0, table[:, 2], table[:, 1], table[:, 0], True, "flow")
    assert assess_loop(loop).verdict in ("stiction", "cannot_tell")


def test_a_stem_whose_valve_is_known_has_its_friction_in_newtons():
    """Of a stem without a positioner, friction and process gain are in their intervals (a development seed)."""
    known = simulated_loop(8623, "stiction", "pressure", "stem")
    values = known.stem.values
    answer = assess_loop(known.loop, valve={"stroke": STROKE, "K": values["spring.K"]})
    assert answer.forces.fs.lower < values["lugre.fs"] < answer.forces.fs.upper
    assert answer.forces.fc.lower < values["lugre.fc"] < answer.forces.fc.upper
    gain = answer.joint.values["process_gain"]
    assert gain.lower < known.gain < gain.upper
    assert answer.as_json()["stiction"]["fs_N"]["value"] == answer.forces.fs.value
    assert any("without a positioner" in line for line in answer.lines())
    air = assess_loop(known.loop, valve={"area": 0.01, "span": 0.2 * values["spring.K"] * STROKE})
    assert air.forces.fs.value == pytest.approx(2 * answer.forces.fs.value)


@pytest.mark.parametrize(
    ("valve", "said"),
    [
        ({"stroke": 0.02}, "not enough"),
        ({"mass": 2.0}, "not known of a valve"),
        ({"stroke": -1.0, "K": 5e4}, "not a positive"),
        ({"stroke": 0.02, "K": 5e4, "area": 0.01, "span": 1.0}, "check the units"),
    ],
)
def test_valve_data_that_give_no_force_are_refused(valve, said):
    known, _ = assessed(6001, "stiction", "flow")
    with pytest.raises(br.BadParameter, match=said):
        assess_loop(known.loop, valve=valve)


def test_a_historian_keeps_a_loop_whole_rounded_compressed_or_interpolated():
    known, _ = assessed(6001, "stiction", "flow")
    kept = [as_kept(known.loop, seed) for seed in range(40)]
    assert {how for _, how in kept} == set(HOW)
    assert all((loop is known.loop) == (how == "whole") for loop, how in kept)
    assert np.array_equal(as_kept(known.loop, 7)[0].pv, kept[7][0].pv)
    rounded = quantised(known.loop, 0.25).pv
    assert np.array_equal(rounded * 4, np.round(rounded * 4))
    straight = interpolated(known.loop, 0.5)
    assert np.mean(np.abs(np.diff(straight.pv, 2)) < 1e-9) > 0.3
    assert np.abs(straight.pv - known.loop.pv).max() < 3.0


@pytest.mark.parametrize("keep", [compressed, interpolated])
def test_a_dead_band_of_one_noise_sigma_cannot_tell(keep):
    """It makes sticky loops look like tuning to methods that look at shapes."""
    for kind in ("flow", "temperature"):
        known, _ = assessed(6004, "stiction", kind)
        answer = assess_loop(keep(known.loop, known.noise))
        assert answer.verdict == "cannot_tell"
        assert "compressed" in answer.why


@pytest.mark.parametrize("valve", ["kano", "he", "stem"])
def test_simulated_valves_have_the_dead_band_that_they_say(valve):
    known = simulated_loop(6001, "stiction", "flow", valve)
    lag = known.loop.op - 50 - known.place
    assert np.quantile(np.abs(lag), 0.98) == pytest.approx((known.s + known.j) / 2, rel=0.25)
    assert known.moves > 5
    assert min(told_by_place(known.loop, known.place)) > 20


@pytest.mark.slow
def test_a_positioner_brings_a_sticky_stem_closer_to_its_set_point_than_its_dead_band():
    known = simulated_loop(6001, "stiction", "flow", "positioned")
    lag = np.abs(known.loop.op - 50 - known.place)
    assert np.quantile(lag, 0.98) < 0.3 * (known.s + known.j) / 2
    assert known.stem is None  # no bridge from OP to its friction


def test_a_valve_without_friction_is_not_told_from_one():
    known = simulated_loop(6015, "noise")
    assert min(told_by_place(known.loop, known.place)) < 20


def test_valve_and_process_have_a_joint_posterior_where_the_data_carry_one():
    known = simulated_loop(6006, "stiction", "flow", "stem")
    values = known.stem.values
    answer = assess_loop(known.loop, valve={"stroke": STROKE, "K": values["spring.K"]})
    joint = answer.joint
    assert joint.refused is None
    assert {*joint.values, *joint.open} == {"fs_N", "fc_N", "process_gain"}
    for name, truth in (("fs_N", values["lugre.fs"]), ("fc_N", values["lugre.fc"])):
        assert joint.values[name].lower <= truth <= joint.values[name].upper
        assert joint.values[name].upper < 2.5 * truth
    assert -1.0 <= joint.correlation["fs_N", "fc_N"] <= 1.0
    assert "mass" in answer.as_json()["stiction"]["joint"]["not_told"]
    assert any("valve and process together: fs_N" in line for line in answer.lines())


def test_a_joint_posterior_is_refused_in_words_for_a_level():
    known, _ = assessed(6003, "stiction", "level")
    answer = assess_loop(known.loop, valve={"stroke": 0.02, "K": 5e4})
    assert answer.forces is not None
    assert "a level has no gain at rest" in answer.joint.refused
    assert any("no joint posterior" in line for line in answer.lines())


def test_texts_in_the_place_of_numbers_are_missing_samples(tmp_path):
    known, _ = assessed(6001, "stiction", "flow")
    file = csv(tmp_path, "time,SP,PV,OP [%]", known.loop)
    rows = file.read_text().splitlines()
    time, sp, _, op = rows[700].split(",")
    rows[700] = f"{time},{sp},No Data,{op}"
    file.write_text("\n".join(rows) + "\n")
    loop, said = read_loop(file)
    assert loop.gaps == 1
    assert any("without a number are missing: No Data" in words for words in said)


def test_a_file_whose_newest_row_stands_first_is_read_from_its_end(tmp_path):
    known, _ = assessed(6001, "stiction", "flow")
    file = csv(tmp_path, "time,SP,PV,OP [%]", known.loop)
    head, *rows = file.read_text().splitlines()
    file.write_text("\n".join([head, *reversed(rows)]) + "\n")
    loop, said = read_loop(file)
    assert np.array_equal(loop.pv, known.loop.pv)
    assert any("newest row stands first" in words for words in said)
    file.write_text("\n".join([head, *rows[50:], *rows[:50]]) + "\n")
    with pytest.raises(br.BadInput, match="runs backwards"):
        read_loop(file)


def test_one_oscillation_counts_once():
    t, rng = np.arange(3000.0), np.random.default_rng(8)
    slow = np.sin(2 * np.pi * t / 700) + 0.3 * rng.normal(0, 0.3, 3000).cumsum() / 10
    found = assess_loop(loop_of("slow", t, None, slow, rng.normal(0, 1, 3000), True, "flow")).oscillations
    periods = [one.period_s for one in found]
    assert all(abs(a / b - 1) > 0.1 for i, a in enumerate(periods) for b in periods[i + 1 :])
