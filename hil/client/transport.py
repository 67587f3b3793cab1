"""What a transport is: the kind of address it has, and how a connection to such an address is opened."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections import Counter
from collections.abc import Awaitable, Callable, Iterator
from dataclasses import dataclass, field
from typing import ClassVar, NamedTuple, Self

from hil.client.wire import Lost, Wire
from hil.modbus.addresses import TIMEOUT_S, AddressParts
from recordings import BadInput


class LinkSide(NamedTuple):
    """What a link gives to its wires. transactions : ids to use; tally : counts what was dropped; lost : see `Lost`."""

    transactions: Iterator[int]
    tally: Counter[str]
    lost: Lost


WireOpening = Callable[[LinkSide], Awaitable[Wire]]
"""Opens a connection. Raises OSError, TerminalError or TimeoutError while the peer cannot be reached."""


@dataclass(frozen=True)
class LiveAddress(ABC):
    """The address of a peer, and with it the transport: a subclass in a module of this folder is found by its scheme.

    text : the whole address; timeout : s to wait for a reply; scheme : what stands before the colon; form : how such an
    address is written, for messages; reopened : whether a new connection is tried when the peer is deaf.
    """

    scheme: ClassVar[str]
    form: ClassVar[str]
    reopened: ClassVar[bool] = True

    text: str
    timeout: float = field(default=TIMEOUT_S, kw_only=True)

    @classmethod
    @abstractmethod
    def of(cls, parts: AddressParts) -> Self:
        """Read an address of this scheme. Raises BadInput naming what is wrong in it."""

    @abstractmethod
    def opening(self) -> WireOpening:
        """What opens a connection, again and again. Raises BadInput for what no waiting heals."""

    def refusal(self, error: BaseException | None) -> BadInput | None:
        """What to tell the user when an error at the start shows a mistake that no waiting heals; else None."""
        return None


def timeout_of(parts: AddressParts) -> float:
    """The option `timeout` [s], which every live address takes. Raises BadInput."""
    return parts.options.number("timeout", TIMEOUT_S, 1e-3, 60.0)
