"""The stated false-alarm rate against what really happens, where what really happens can be simulated."""

from __future__ import annotations

import dataclasses
import json
import math

import numpy as np
import pytest
from scipy.signal import lfilter

from detector import MONTH_S, Evidence, EvidenceState, Promise, learn_evidence
from recordings import Array, BadInput

DT_S = 0.1


def gaussian(n: int, seed: int) -> Array:
    return np.random.default_rng(seed).normal(size=n)


def heavy(n: int, seed: int) -> Array:
    return np.random.default_rng(seed).standard_t(3.0, size=n)


def remembering(n: int, seed: int) -> Array:
    """Correlated over a second."""
    return np.asarray(lfilter([math.sqrt(1.0 - 0.9**2)], [1.0, -0.9], gaussian(n, seed)))


def wandering(n: int, seed: int) -> Array:
    """A size that wanders by a quarter within twenty minutes."""
    keep = math.exp(-1.0 / 12_000)
    path = lfilter([math.sqrt(1.0 - keep**2)], [1.0, -keep], gaussian(n, seed + 1000))
    return np.asarray(gaussian(n, seed) * np.exp(0.25 * path))


def learned(values: Array, wish_s: float = MONTH_S) -> Evidence:
    return learn_evidence({"residual": values}, DT_S, wish_s)


def first_alarm(evidence: Evidence, values: Array, state: EvidenceState | None = None) -> float:
    """Seconds until the first alarm, infinite for none."""
    over = np.flatnonzero(evidence.run(state or evidence.initial(), values[:, None])[1][:, 0] >= 1.0)
    return (int(over[0]) + 1) * DT_S if len(over) else math.inf


def coarse(n: int, seed: int) -> Array:
    """In steps of four sizes: mostly nothing."""
    return 4.0 * np.round((gaussian(n, seed)) / 4.0)


@pytest.mark.parametrize("residual", [gaussian, heavy, remembering, wandering, coarse])
@pytest.mark.parametrize("learned_s", [200.0, 1200.0])
def test_there_are_no_more_alarms_than_promised_in_days_without_a_fault(residual, learned_s):
    n = round(learned_s / DT_S)
    for seed in range(501, 504):
        values = residual(n + 864_000, seed)
        assert first_alarm(learned(values[:n]), values[n:]) == math.inf


def test_the_mean_time_to_a_false_alarm_is_at_least_the_limit_where_all_is_as_assumed():
    """A wish so short that alarms come, and blocks exactly as bad as they may be: signs of a biased residual."""
    evidence = learned(gaussian(36_000, 521))
    wished = dataclasses.replace(evidence, promise=Promise.of(3600.0, 60.0), learns=False)
    bias = 1.5 * 0.25 * math.sqrt(3.42 / 2.3) * evidence.healthy[0].size  # what is allowed for, and no more
    times = [min(first_alarm(wished, gaussian(20_000, seed) + bias), 2000.0) for seed in range(530, 560)]
    assert np.mean(times) >= 60.0
    assert np.median(times) < 2000.0


@pytest.mark.parametrize(("shift", "within_s"), [(1.0, 60.0), (3.0, 8.0), (40.0, 0.3)])
def test_a_lasting_shift_is_found_in_time(shift, within_s):
    evidence = learned(gaussian(6000, 541))
    delays = [first_alarm(evidence, gaussian(6000, seed) + shift) for seed in range(542, 549)]
    assert np.median(delays) <= within_s


def test_bursts_and_a_fourfold_size_are_found():
    evidence = learned(gaussian(36_000, 551))
    assert first_alarm(evidence, 4.0 * gaussian(6000, 552)) < 400.0
    bursts = gaussian(6000, 553)
    bursts[np.arange(6000) % 100 < 5] += 10.0
    assert first_alarm(evidence, bursts) < 300.0


def test_a_doubled_size_is_found_after_a_day_and_a_wandering_one_is_none():
    evidence = learned(gaussian(864_000, 555))
    assert first_alarm(evidence, 2.0 * gaussian(36_000, 556)) < 1200.0
    assert first_alarm(learned(wandering(864_000, 557)), wandering(864_000, 558)) == math.inf


def test_a_large_shift_of_a_correlated_residual_is_found_within_eighty_of_its_memories():
    evidence = learned(remembering(6000, 559))
    assert np.median([first_alarm(evidence, remembering(6000, seed) + 3.0) for seed in range(560, 565)]) < 80.0


def test_equal_values_are_no_drift():
    assert learned(np.round(gaussian(36_000, 560))).promise.findings == ()


def test_pieces_give_the_same_bits_as_the_whole_also_through_json_and_across_a_period():
    values = wandering(80_000, 561)
    values[5000:5400] = np.nan
    evidence = learned(values[:3000])
    whole, load = evidence.run(evidence.initial(), values[3000:, None])
    again = Evidence.from_dict(json.loads(json.dumps(evidence.as_dict())))
    state, parts = again.initial(), []
    for first in range(3000, len(values), 7919):
        state = EvidenceState.from_dict(json.loads(json.dumps(state.as_dict())))
        state, part = again.run(state, values[first : min(first + 7919, len(values)), None])
        parts.append(part)
    assert np.array_equal(np.concatenate(parts), load)
    assert state.as_dict() == whole.as_dict()


def test_learning_goes_on_in_service_towards_the_wish_and_limits_only_come_down():
    evidence = learned(gaussian(800, 571))
    state, _ = evidence.run(evidence.initial(), gaussian(26 * 36_000, 572)[:, None])
    assert state.trusted_s == 80.0 + 25 * 3600.0
    assert not evidence.promise.kept
    assert evidence.supported(state).kept
    assert (state.limits <= evidence.healthy[0].limits).all()
    late = 3.0 * gaussian(60_000, 573)
    assert first_alarm(evidence, late, state) < first_alarm(evidence, late)


def test_an_hour_in_service_is_no_day_however_long_was_learned_before():
    """Limits wait for a day of service: an hour does not show how a size wanders."""
    evidence = learn_evidence({"residual": gaussian(8640, 574)}, 10.0, MONTH_S)
    state, _ = evidence.run(evidence.initial(), gaussian(3 * 360, 575)[:, None])
    assert state.trusted_s == 86_400.0 + 2 * 3600.0
    assert np.array_equal(state.limits[0], evidence.healthy[0].limits)


def test_a_slow_fault_is_not_learned_away():
    """A bias that grows by a size in two days alarms, though learning goes on, at a size that is still small."""
    evidence, n = learned(gaussian(36_000, 581)), 2 * 864_000
    alarm_s = first_alarm(evidence, gaussian(n, 582) + np.linspace(0.0, 1.0, n))
    assert alarm_s / (n * DT_S) < 0.6


def test_a_period_with_an_alarm_is_not_learned_from():
    evidence = learned(gaussian(6000, 591))
    values = gaussian(3 * 36_000, 592)
    values[40_000:40_200] += 10.0
    state, load = evidence.run(evidence.initial(), values[:, None])
    assert load.max() >= 1.0
    assert state.trusted_s == 600.0


def test_what_is_seen_in_the_data_weakens_the_promise_and_too_little_is_refused_with_what_it_takes():
    assert learned(gaussian(6000, 601)).promise.sentence == (
        "false alarms: 10 minutes fault-free support at most one in 6.9 days; "
        "for one in 30 days it needs about 43 minutes"
    )
    drifting = gaussian(6000, 602) + np.linspace(0.0, 1.0, 6000)
    assert "because the residual drifts" in learned(drifting).promise.sentence
    growing = gaussian(6000, 603) * np.linspace(1.0, 2.0, 6000)
    assert "because the residual's size changes" in learned(growing).promise.sentence
    assert learned(growing).promise.interval_s < learned(gaussian(6000, 604)).promise.interval_s
    with pytest.raises(BadInput, match="too few"):
        learned(gaussian(150, 605))
    with pytest.raises(BadInput, match="never changes"):
        learned(np.zeros(1000))


def test_a_residual_that_cannot_be_learned_is_left_out_in_words():
    evidence = learn_evidence(
        {"good": gaussian(6000, 611), "still": np.zeros(6000)}, DT_S, MONTH_S, {"good": 0.4, "still": 0.6}
    )
    assert evidence.names == ("good",)
    assert evidence.shares == (1.0,)
    assert "still" in evidence.notes[0]


def test_of_too_few_independent_blocks_only_gross_residuals_are_judged_and_a_note_says_what_it_takes():
    evidence = learned(remembering(600, 615))
    assert "only gross residuals" in evidence.notes[0]
    assert first_alarm(evidence, remembering(36_000, 616) + 3.0) == math.inf
    assert first_alarm(evidence, remembering(600, 617) + 100.0) < 6.0
    assert first_alarm(evidence, remembering(864_000, 618)) == math.inf


def test_a_state_of_another_detector_is_refused():
    parts = learned(gaussian(6000, 621)).initial().as_dict()
    with pytest.raises(BadInput, match="another detector"):
        EvidenceState.from_dict(parts | {"limits": [[1.0]]})
