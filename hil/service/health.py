"""What state a valve is in, and why: facts in, the worst of all causes out, in the words of NAMUR NE 107.

``failure`` is kept for evidence against the device itself: its position cannot be believed. ``check function`` says
that nothing valid is known at the moment: no communication, a stale value, learning, a detector that does not run.
``out of specification`` says that the valve, or the way its values take, is not in its usual conditions. ``maintenance
required`` is a change of the valve that it still works with. So trouble of communication is never a valve's fault.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime

from hil.service.status import Health

UNSETTLED_S = 60.0
"""For so long after it a trouble of communication is spoken of [s]."""


@dataclass(frozen=True)
class ValveFacts:
    """What is known of a valve at a moment. age_s : of the last good position [s]; stale_s : from when on it is stale
    [s]; down : why there is no connection, empty while there is one; bad : signals without a usable value in the newest
    sample, with the reason; unsettled : what happened to the link in the last minute; detector_error : why detection
    does not run; phase, learned, load, kind, test : of the detector.
    """

    age_s: float
    stale_s: float
    connected: bool
    down: str = ""
    bad: tuple[tuple[str, str], ...] = ()
    unsettled: tuple[str, ...] = ()
    detector_error: str = ""
    phase: str = "learning"
    learned: str = ""
    load: float = 0.0
    kind: str | None = None
    alarm_text: str = ""


@dataclass(frozen=True)
class HealthCause:
    """One reason for a state. key : the same for as long as it is the same trouble."""

    key: str
    health: Health
    reason: str
    evidence: tuple[str, ...] = ()
    check: tuple[str, ...] = ()


FINE = HealthCause("good", Health.GOOD, "it behaves as it was learned")

_CABLE = (
    "power of the device and of the gateway", "cable and plugs", "address, device id and baud rate in the plant file",
)  # fmt: skip

_ALARMS: Mapping[str | None, tuple[Health, str, tuple[str, ...]]] = {
    "friction": (
        Health.MAINTENANCE, "the friction has changed",
        ("packing: tightness, lubrication, dirt", "stem and guides for scoring or bending",
         "compare with a signature test: bristle test --kind signature"),
    ),
    "spring": (
        Health.MAINTENANCE, "the spring, or the area of the diaphragm, has changed",
        ("actuator for air that leaks at diaphragm or seals", "spring for a broken coil",
         "bench set, by a signature test"),
    ),
    "sensor": (
        Health.FAILURE, "the position cannot be believed: position and flow do not fit each other",
        ("feedback lever and its coupling to the stem", "zero and span of the position transmitter",
         "stem position by eye"),
    ),
    "supply": (
        Health.OUT_OF_SPEC, "the supply pressure is not usual",
        ("air supply and its filter regulator", "other consumers on the same line"),
    ),
    "flow": (
        Health.OUT_OF_SPEC, "flow or process pressures are not what belongs to the opening",
        ("process conditions against those learned in", "plug and seat for erosion or something stuck",
         "flow transmitter"),
    ),
    None: (
        Health.OUT_OF_SPEC, "the valve moves unlike it was learned, for a reason that has no name",
        ("positioner and its air lines", "work that was done on the valve lately",
         "record it and trace: bristle trace"),
    ),
}  # fmt: skip


def causes(facts: ValveFacts) -> Iterator[HealthCause]:
    """Every cause that the facts give."""
    yield from _communication(facts)
    if facts.detector_error:
        where = ("the log of the service",)
        text = "detection does not run; it is begun again"
        yield HealthCause("detector", Health.CHECK, text, (facts.detector_error,), where)
    if facts.phase == "learning":
        move = ("let the valve move over its usual range", "or give recordings of it in good order: calibrate = [..]")
        yield HealthCause(
            "learning", Health.CHECK, "it is still being learned, nothing is judged yet", (facts.learned,), move
        )
    elif facts.phase == "alarm":
        health, reason, check = _ALARMS.get(facts.kind, _ALARMS[None])
        score = f"largest score {facts.load:.3g}, limit 1"
        yield HealthCause(f"alarm {facts.kind}", health, reason, tuple(filter(None, (facts.alarm_text, score))), check)


def _communication(facts: ValveFacts) -> Iterator[HealthCause]:
    position = dict(facts.bad).get("position")
    age = f"last good position {facts.age_s:.1f} s ago" if facts.age_s < float("inf") else "no good position so far"
    if not facts.connected:
        said = facts.down or "the device has not answered yet"
        reason = "no communication: nothing is known of the valve at the moment"
        yield HealthCause("link", Health.CHECK, reason, (said, age), _CABLE)
    elif position is not None:
        look = ("the transmitter's own diagnosis", "valid range and type of 'position' in the map: bristle probe")
        yield HealthCause("position", Health.CHECK, "the position comes, but cannot be used", (position, age), look)
    elif facts.age_s > facts.stale_s:
        reason = "the values are stale: the device answers, but nothing new comes"
        yield HealthCause("stale", Health.CHECK, reason, (age,), ("whether the device is in service", *_CABLE[:1]))
    else:
        others = tuple(f"{name}: {why}" for name, why in facts.bad)
        if others:
            look = ("the transmitters of these signals", "their type and valid range in the map: bristle probe")
            yield HealthCause("values", Health.OUT_OF_SPEC, "some values cannot be used", others, look)
        elif facts.unsettled:
            reason = "values come irregularly; the valve is watched with what comes"
            yield HealthCause("irregular", Health.OUT_OF_SPEC, reason, facts.unsettled, _CABLE[1:2])


@dataclass(frozen=True)
class Standing:
    """The worst cause, and since when it has been: UTC."""

    cause: HealthCause
    since: datetime

    @classmethod
    def first(cls) -> Standing:
        """Before anything is known."""
        unknown = HealthCause("link", Health.CHECK, "no communication: nothing is known of the valve at the moment")
        return cls(unknown, datetime.now(UTC))

    def after(self, facts: ValveFacts, now: datetime) -> Standing:
        """The standing now: the first of the worst causes; `since` stays while the cause is the same."""
        worst = max(causes(facts), key=lambda one: one.health.rank, default=FINE)
        return Standing(worst, self.since if worst.key == self.cause.key else now)
