"""The command line: one thin function per command in `bristle.commands`, heavy imports inside the functions."""

from bristle._app import main

__all__ = ["main"]
