"""The error of terminals, which Python has on Unix only."""

from __future__ import annotations

TerminalError: type[Exception]
"""What calls on a serial line or a pseudo terminal raise besides OSError."""

try:
    from termios import error
except ModuleNotFoundError:  # Windows: TCP works, and serial lines raise OSError
    TerminalError = OSError
else:
    TerminalError = error
