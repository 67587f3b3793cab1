"""What state a valve is in, and why: facts in, the worst of all causes out, in the words of NAMUR NE 107.

``failure`` is kept for evidence against the device itself: its position cannot be believed. ``check function`` says
that nothing valid is known at the moment: no communication, a stale value, learning, a detector that does not run.
``out of specification`` says that the valve is not in its usual conditions. ``maintenance required`` is a change of the
valve that it still works with. So trouble of communication is never a valve's fault: it is ``check function`` for as
long as it lasts, and leaves nothing behind. How good a link has been is said of the link (`LinkStatus`), not here.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime

from detector import ADVICE
from hil.service.status import Health


@dataclass(frozen=True)
class ValveFacts:
    """What is known of a valve at a moment. age_s : of the last good position [s]; stale_s : from when on it is stale
    [s]; down : why there is no connection, empty while there is one; bad : signals of which the device has told nothing
    usable for `stale_s`, with the reason; unread : those of which nothing fresh has come; detector_error : why
    detection does not run; phase, learned, load, kind, alarm_text : of the detector; judged, supported : what is said
    while it learns, see `WatchStatus`.
    """

    age_s: float
    stale_s: float
    connected: bool
    down: str = ""
    bad: tuple[tuple[str, str], ...] = ()
    unread: tuple[tuple[str, str], ...] = ()
    detector_error: str = ""
    phase: str = "learning"
    learned: str = ""
    load: float = 0.0
    kind: str | None = None
    alarm_text: str = ""
    judged: str = ""
    supported: str = ""


@dataclass(frozen=True)
class HealthCause:
    """One reason for a state. key : the same for as long as it is the same trouble."""

    key: str
    health: Health
    reason: str
    evidence: tuple[str, ...] = ()
    check: tuple[str, ...] = ()


_UNKNOWN = "no communication: nothing is known of the valve at the moment"

FINE = HealthCause("good", Health.GOOD, "it behaves as it was learned")

_CABLE = (
    "power of the device and of the gateway", "cable and plugs", "address, device id and baud rate in the plant file",
)  # fmt: skip

_STATES: Mapping[str | None, Health] = {
    "friction": Health.MAINTENANCE, "spring": Health.MAINTENANCE, "sensor": Health.FAILURE,
}  # fmt: skip
"""The state of an alarm by its kind; of all others the valve is not in its usual conditions."""


def causes(facts: ValveFacts) -> Iterator[HealthCause]:
    """Every cause of the valve itself, and of those who watch it, that the facts give."""
    bad = dict(facts.bad)
    position = bad.pop("position", None)
    if position is not None:
        look = ("the transmitter's own diagnosis", "valid range and type of 'position' in the map: bristle probe")
        yield HealthCause(
            "position", Health.CHECK, "the position comes, but cannot be used", (position, _age(facts)), look
        )
    if bad:
        look = ("the transmitters of these signals", "their type and valid range in the map: bristle probe")
        others = tuple(f"{name}: {why}" for name, why in bad.items())
        yield HealthCause("values", Health.OUT_OF_SPEC, "some values cannot be used", others, look)
    if facts.detector_error:
        where = ("the log of the service",)
        text = "detection does not run; it is begun again"
        yield HealthCause("detector", Health.CHECK, text, (facts.detector_error,), where)
    if facts.phase == "learning":
        move = ("let the valve move over its usual range", "or give recordings of it in good order: calibrate = [..]")
        known = tuple(filter(None, (facts.learned, facts.judged, facts.supported)))
        yield HealthCause("learning", Health.CHECK, "it is still being learned", known, move)
    elif facts.phase == "alarm":
        advice = ADVICE.get(facts.kind, ADVICE[None])
        health = _STATES.get(facts.kind, Health.OUT_OF_SPEC)
        score = f"largest score {facts.load:.3g}, limit 1"
        shown = tuple(filter(None, (facts.alarm_text, score)))
        yield HealthCause(f"alarm {facts.kind}", health, advice.reason, shown, advice.check)


def communication(facts: ValveFacts) -> HealthCause | None:
    """What keeps the valve from being known at this moment, None while its values come."""
    if not facts.connected:
        said = facts.down or "the device has not answered yet"
        return HealthCause("link", Health.CHECK, _UNKNOWN, (said, _age(facts)), _CABLE)
    if facts.age_s > facts.stale_s and "position" not in dict(facts.bad):
        why = tuple(text for name, text in facts.unread if name == "position")
        reason = "the values are stale: the device answers, but nothing new comes"
        look = ("whether the device is in service", *_CABLE[:1])
        return HealthCause("stale", Health.CHECK, reason, (*why, _age(facts)), look)
    if facts.unread:
        reason = "some values do not come; the valve is watched without them"
        others = tuple(f"{name}: {why}" for name, why in facts.unread)
        return HealthCause("unread", Health.CHECK, reason, others, (*_CABLE[:2], "their addresses: bristle probe"))
    return None


def _age(facts: ValveFacts) -> str:
    known = facts.age_s < float("inf")
    return f"last good position {facts.age_s:.1f} s ago" if known else "no good position so far"


@dataclass(frozen=True)
class Lasting:
    """A cause, and since when it has been: UTC."""

    cause: HealthCause
    since: datetime

    def after(self, cause: HealthCause, now: datetime) -> Lasting:
        """The cause now; `since` stays while it is the same."""
        return Lasting(cause, self.since if cause.key == self.cause.key else now)


@dataclass(frozen=True)
class Standing:
    """How a valve stands. valve : the worst cause of the valve itself; link : what keeps it from being known at the
    moment, None when nothing does. Two things: when the link is back, the valve stands as it stood before, and since
    then.
    """

    valve: Lasting
    link: Lasting | None = None

    @classmethod
    def first(cls) -> Standing:
        """Before anything is known."""
        unknown = Lasting(HealthCause("link", Health.CHECK, _UNKNOWN), datetime.now(UTC))
        return cls(unknown, unknown)

    @property
    def worst(self) -> Lasting:
        """The worse of the two, the link where they are alike: what is not known cannot be judged."""
        link, valve = self.link, self.valve
        return link if link is not None and link.cause.health.rank >= valve.cause.health.rank else valve

    def after(self, facts: ValveFacts, now: datetime) -> Standing:
        """The standing now."""
        worst = max(causes(facts), key=lambda one: one.health.rank, default=FINE)
        trouble = communication(facts)
        if trouble is None:
            return Standing(self.valve.after(worst, now))
        valve = self.valve if worst is FINE else self.valve.after(worst, now)  # without values nothing becomes good
        return Standing(valve, (self.link or Lasting(trouble, now)).after(trouble, now))
