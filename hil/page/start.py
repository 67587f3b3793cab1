"""What the process of a page is told first. It comes over the pipe, where no list of processes shows the token."""

from __future__ import annotations

from pathlib import Path
from typing import Self

from pydantic import BaseModel, ConfigDict

from hil.page.access import Access


class PageStart(BaseModel):
    """The first line. listening : number of the bound socket; recordings : folder, None where nothing is recorded."""

    model_config = ConfigDict(extra="forbid")

    listening: int
    host: str
    port: int
    token: str | None
    certificate: Path | None
    key: Path | None
    recordings: Path | None

    @classmethod
    def of(cls, access: Access, listening: int, recordings: Path | None) -> Self:
        """Everything that the process needs to know."""
        return cls(
            listening=listening, host=access.host, port=access.port, token=access.token,
            certificate=access.certificate, key=access.key, recordings=recordings,
        )  # fmt: skip

    @property
    def access(self) -> Access:
        """Who may look."""
        return Access(self.host, self.port, self.token, self.certificate, self.key)

    def line(self) -> bytes:
        """As it goes over the pipe."""
        return self.model_dump_json().encode() + b"\n"
