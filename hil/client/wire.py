"""What every open connection can do, whatever it is made of: one request at a time, and a verdict on its reply.

pymodbus' client hides what safety needs: it clears its buffer with every request, takes a reply with transaction id 0,
the wrong function or the wrong length, and gives no hold on bytes that nobody asked for. So only its serial transport
(pyserial on the event loop) is used, and the two wires, `TcpWire` and `RtuWire`, hand what arrives to the pure
functions of `hil.modbus.checks`.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from hil.modbus.messages import Reply, ReplyFault, Request

Lost = Callable[[Exception | None], None]
"""Called once, at once, when the connection is gone: with the reason, or None when the peer closed it."""

GONE = Reply(fault=ReplyFault.LOST, text="the connection is closed")


class Wire(Protocol):
    """An open connection; one exchange at a time."""

    async def exchange(self, request: Request) -> Reply:
        """Send one request and return the verdict on its reply. Raises nothing, whatever the peer does."""

    def listens(self, unit: int) -> bool:
        """Whether a unit cannot be asked for a while, because its reply to an earlier request may still come."""

    def close(self) -> None:
        """Close the connection; `Lost` is not called."""
