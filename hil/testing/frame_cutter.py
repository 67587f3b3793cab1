"""The bytes of a stream cut into replies, as an injector needs them."""

from __future__ import annotations

from typing import Literal

from hil.modbus.framing import MBAP, Frame, FrameHeader, rtu_reply_size

Framing = Literal["tcp", "rtu"]


def parsed(framing: Framing, data: bytes) -> Frame:
    """The reply in a whole frame, as `FrameCutter` delivers it."""
    return Frame.of_tcp(data) if framing == "tcp" else Frame.of_rtu(data)


def built(framing: Framing, reply: Frame) -> bytes:
    """The bytes on the wire, with a length or a check that is right."""
    return reply.tcp() if framing == "tcp" else reply.rtu()


class FrameCutter:
    """Cuts the bytes that a server sends into its replies. What is no frame is passed on as one piece."""

    def __init__(self, framing: Framing) -> None:
        self._size = _tcp_size if framing == "tcp" else rtu_reply_size
        self._pending = bytearray()

    def feed(self, data: bytes) -> list[bytes]:
        """The replies that are complete now."""
        self._pending += data
        frames = []
        while self._pending:
            size = self._size(self._pending)
            if size is None or size > len(self._pending):
                break
            frames.append(bytes(self._pending[:size]))
            del self._pending[:size]
        return frames


def _tcp_size(data: bytearray) -> int | None:
    header = FrameHeader.at(data)
    return None if header is None else max(header.size, MBAP + 1)
