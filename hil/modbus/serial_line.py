"""A serial line as the system sees it: whether it can be opened now, and if not, why, in words."""

from __future__ import annotations

import errno
import os
from dataclasses import replace

import serial

from hil.modbus.addresses import SerialLine
from hil.modbus.terminals import TerminalError
from recordings import BadInput

_PSEUDO_TERMINALS = range(136, 144)
"""Major device numbers of Linux' pseudo terminals (Documentation/admin-guide/devices.txt)."""


def usable(line: SerialLine) -> SerialLine:
    """The line with a parity that it can be opened with: a pseudo terminal has none, and refuses to be given one."""
    try:
        pseudo = os.major(os.stat(line.device).st_rdev) in _PSEUDO_TERMINALS
    except OSError:
        return line
    return replace(line, parity="N") if pseudo else line


def check_serial_line(where: str, line: SerialLine) -> None:
    """Open and close a serial line. Raises BadInput, about `where`, when that is not possible.

    Later it may vanish and come back, but a wrong name at the start is a mistake.
    """
    try:
        serial.Serial(line.device, line.baud, parity=usable(line).parity, exclusive=True).close()
    except (OSError, ValueError, TerminalError) as error:
        raise BadInput(where, *_reason(line.device, error)) from None


def _reason(device: str, error: Exception) -> tuple[str, str]:
    """What is wrong and what to do."""
    number = getattr(error, "errno", None)
    if number == errno.ENOENT:
        return f"there is no serial device {device}", "check the name and the cable"
    if number == errno.EACCES:
        return f"no permission for the serial device {device}", "join the group that owns it (often dialout)"
    if "lock" in str(error) or number in {errno.EBUSY, errno.EAGAIN}:
        return f"the serial device {device} is busy", "stop the other program that uses it"
    return f"{device} is not a usable serial device ({error})", "name a serial device, and a speed that it knows"
