"""Health in the words of NE 107: which facts give which state, and since when."""

from __future__ import annotations

from dataclasses import replace
from datetime import UTC, datetime, timedelta
from itertools import product
from math import inf, nan

import pytest

from detector import KINDS
from hil import Health, LinkEvent, Quality, Reading, Sample
from hil.service.acquisition import ValveLink
from hil.service.health import FINE, HealthCause, Standing, ValveFacts

GOOD = ValveFacts(0.1, 2.0, True, phase="watching")
NOW = datetime(2026, 11, 23, 12, 0, tzinfo=UTC)


def cause(facts: ValveFacts):
    return Standing.first().after(facts, NOW).worst.cause


def test_every_state_has_its_own_letter_shape_and_colour_and_the_worst_wins():
    for of in ("letter", "shape", "colour", "rank"):
        assert len({getattr(one, of) for one in Health}) == len(Health)
    assert [one.letter for one in Health] == ["", "M", "S", "C", "F"]
    assert Health.worst([Health.CHECK, Health.FAILURE, Health.GOOD]) is Health.FAILURE
    assert Health.worst([]) is Health.GOOD


@pytest.mark.parametrize(
    ("changes", "health", "words"),
    [
        ({}, Health.GOOD, "as it was learned"),
        ({"connected": False, "down": "refused"}, Health.CHECK, "no communication"),
        ({"age_s": 5.0}, Health.CHECK, "stale"),
        ({"unread": (("flow", "link: timeout"),)}, Health.CHECK, "do not come"),
        ({"age_s": 5.0, "bad": (("position", "bad: out of range"),)}, Health.CHECK, "cannot be used"),
        ({"bad": (("flow", "bad: not a number"),)}, Health.OUT_OF_SPEC, "some values"),
        ({"phase": "learning"}, Health.CHECK, "still being learned"),
        ({"detector_error": "ValueError: x"}, Health.CHECK, "detection does not run"),
        ({"phase": "alarm", "kind": "friction"}, Health.MAINTENANCE, "friction has changed"),
        ({"phase": "alarm", "kind": "spring"}, Health.MAINTENANCE, "spring"),
        ({"phase": "alarm", "kind": "sensor"}, Health.FAILURE, "position cannot be believed"),
        ({"phase": "alarm", "kind": None}, Health.OUT_OF_SPEC, "no name"),
    ],
)
def test_facts_give_a_state_a_reason_evidence_and_what_to_check(changes, health, words):
    found = cause(replace(GOOD, **changes))
    assert (found.health, words in found.reason) == (health, True)
    if health is not Health.GOOD:
        assert found.evidence
        assert found.check


def test_whatever_happens_to_the_link_it_is_never_a_fault_of_the_valve():
    ages, connections, bad = (0.1, 5.0, inf), (True, False), ((), (("position", "x"),), (("flow", "x"),))
    for age, connected, wrong, unread in product(ages, connections, bad, bad):
        facts = replace(GOOD, age_s=age, connected=connected, bad=wrong, unread=unread)
        assert cause(facts).health not in (Health.FAILURE, Health.MAINTENANCE)


def test_every_kind_of_alarm_has_words():
    for kind in KINDS:
        found = cause(replace(GOOD, phase="alarm", kind=kind, load=3.0, alarm_text="test 'x'"))
        assert found.health is not Health.GOOD
        assert found.evidence[0] == "test 'x'"
        assert len(found.check) >= 2


def test_since_stays_for_as_long_as_the_cause_does():
    standing = Standing.first().after(GOOD, NOW)
    assert (standing.worst.cause, standing.link) == (FINE, None)
    assert standing.worst.since == NOW
    later = standing.after(replace(GOOD, age_s=0.2), NOW + timedelta(hours=1))
    assert later.worst.since == NOW
    changed = later.after(replace(GOOD, phase="alarm", kind="friction"), NOW + timedelta(hours=2))
    assert changed.worst.since == NOW + timedelta(hours=2)


@pytest.mark.parametrize("changes", [{}, {"phase": "alarm", "kind": "friction", "load": 3.0}])
@pytest.mark.parametrize("trouble", [{"connected": False}, {"age_s": 9.0}, {"unread": (("flow", "link: timeout"),)}])
def test_a_valve_stands_after_a_trouble_of_the_link_as_it_stood_before_and_since_then(changes, trouble):
    facts = replace(GOOD, **changes)
    before = Standing.first().after(facts, NOW)
    lost = before.after(replace(facts, **trouble), NOW + timedelta(hours=1))
    assert (lost.worst.cause.health, lost.worst.since) == (Health.CHECK, NOW + timedelta(hours=1))
    assert lost.after(facts, NOW + timedelta(hours=2)) == before


def test_without_values_nothing_is_good():
    begun = Standing.first()
    waiting = begun.after(replace(GOOD, connected=False), NOW)
    assert waiting.worst.cause.health is Health.CHECK
    assert waiting.after(GOOD, NOW + timedelta(hours=1)).worst.since == NOW + timedelta(hours=1)


def test_one_good_sample_after_an_outage_is_enough_and_one_bad_value_between_good_ones_is_nothing():
    """Counted in rounds, at 10 Hz, without a clock: what the page needs to be back within two seconds."""
    link = ValveLink("V1", "tcp://rig", 10.0, ())

    def looked(at: float, item: Sample | LinkEvent | None = None) -> HealthCause:
        nonlocal standing
        if item is not None:
            link.take(item, at)
        facts = replace(GOOD, age_s=link.age_s(at), stale_s=link.stale_s, connected=link.connected, down=link.down)
        bad, unread = link.unusable(at)
        standing = standing.after(replace(facts, bad=bad, unread=unread), NOW + timedelta(seconds=at))
        return standing.worst.cause

    def sample(at: float, flow: Reading) -> Sample:
        return Sample(at, at, "V1", {"position": Reading(0.01, "m"), "flow": flow})

    standing, fresh = Standing.first(), Reading(3.0, "m3/h")
    assert looked(0.0, sample(0.0, fresh)) is FINE
    lost = Reading(nan, "m3/h", Quality.LINK, "no reply")
    assert looked(0.1, sample(0.1, lost)) is FINE
    assert looked(0.2, sample(0.2, fresh)) is FINE
    assert looked(0.3, LinkEvent(0.3, 0.3, "V1", "link_down", "refused")).key == "link"
    assert "in the last minute 1 trouble(s), the last: link_down: refused" in link.status(30.0, 0).words
    assert looked(600.0).key == "link"
    assert looked(600.1, LinkEvent(600.1, 600.1, "V1", "link_up", "it answers")).key == "stale"
    assert looked(600.2, sample(600.2, fresh)) is FINE
    assert standing.worst.since == NOW
    rounds = [600.2 + 0.1 * k for k in (1, 19, 21)]
    assert [looked(at, sample(at, lost)).key for at in rounds] == ["good", "good", "unread"]
