"""What outlives the service: two files a valve, written whole or not at all, and set aside when they cannot be used."""

from __future__ import annotations

import logging
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated, Literal, TypeVar

from pydantic import AwareDatetime, BaseModel, ConfigDict, Field, ValidationError

from hil.monitor.state import load_state, save_state
from hil.service.health import HealthCause, Lasting, Standing
from hil.service.in_service.movements import KeptMovements
from hil.service.lane import ValveLane
from hil.service.status import Health
from recordings import BadInput, read_small_json, save_text

LARGEST_FILE = 4_000_000
Kept = TypeVar("Kept")
Words = Annotated[str, Field(max_length=2000)]

LOG = logging.getLogger("bristle.monitor")


class KeptStanding(BaseModel):
    """How a valve stood, since when, and what its movements had said, as a file."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    format: Literal["monitor-service"] = "monitor-service"
    version: Literal[1] = 1
    key: Words
    health: Health
    reason: Words
    since: Annotated[AwareDatetime, Field(ge=datetime(2000, 1, 1, tzinfo=UTC), le=datetime(2200, 1, 1, tzinfo=UTC))]
    movements: KeptMovements


class StateFolder:
    """Where the state of every valve is kept: ``TAG.state.json`` is the detector's, ``TAG.service.json`` the rest.

    folder : made when it is not there. Raises BadInput when nothing can be written there.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        try:
            folder.mkdir(parents=True, exist_ok=True)
            trial = folder / ".writable"
            trial.touch()
            trial.unlink()
        except OSError as error:
            found = f"nothing can be written there ({error.strerror})"
            raise BadInput(
                str(folder), found, "choose another folder for the state, or change its permissions"
            ) from None

    def detector_file(self, tag: str) -> Path:
        """Of what a valve's detector has learned."""
        return self.folder / f"{tag}.state.json"

    def service_file(self, tag: str) -> Path:
        """Of how a valve stands."""
        return self.folder / f"{tag}.service.json"

    def resume(self, lane: ValveLane) -> bool:
        """Give a lane what an earlier service knew; returns whether its detector was among it."""
        standing = _usable(self.service_file(lane.tag), _standing)
        if standing is not None:
            cause = HealthCause(standing.key, standing.health, standing.reason)
            lane.standing = Standing(Lasting(cause, standing.since.astimezone(UTC)), lane.standing.link)
            lane.movements.resume(standing.movements)
        key = lane.plan.model_key
        known = _usable(self.detector_file(lane.tag), lambda path: load_state(path, key))
        if not known or not lane.monitor.resume(known):
            return False
        try:
            lane.monitor.check()
        except BadInput as problem:
            _set_aside(self.detector_file(lane.tag), problem)
            lane.forget()
            return False
        return True

    def save(self, lane: ValveLane) -> None:
        """Write both files of a valve. Raises BadInput when the disk refuses."""
        if lane.watch.watch is not None and lane.watch.state is not None:
            save_state(self.detector_file(lane.tag), [lane.watch], lane.plan.model_key)
        cause, since = lane.standing.valve.cause, lane.standing.valve.since
        kept = KeptStanding(
            key=cause.key, health=cause.health, reason=cause.reason, since=since, movements=lane.movements.kept()
        )
        save_text(self.service_file(lane.tag), kept.model_dump_json() + "\n")


def _standing(path: Path) -> KeptStanding:
    try:
        return KeptStanding.model_validate(read_small_json(path, "it begins anew", LARGEST_FILE))
    except ValidationError as error:
        found = f"it is damaged ({error.errors()[0]['msg']})"
        raise BadInput(str(path), found, "it begins anew") from None


def _usable(path: Path, load: Callable[[Path], Kept]) -> Kept | None:
    """What a file holds; None where there is none, or where it cannot be used and was set aside."""
    if not path.exists():
        return None
    try:
        return load(path)
    except BadInput as problem:
        _set_aside(path, problem)
        return None


def _set_aside(path: Path, problem: BadInput) -> None:
    """Keep a file that cannot be used under another name, and say so: a service must start, and nothing may be lost."""
    aside = path.with_name(f"{path.name}.{datetime.now(UTC):%Y%m%dT%H%M%S%f}.unusable")
    try:
        path.rename(aside)
        LOG.warning("%s: %s; it is set aside as %s, and learning begins anew", path, problem.found, aside.name)
    except OSError as error:
        LOG.warning("%s: %s; it cannot be set aside (%s), and learning begins anew", path, problem.found, error)
