"""What is in a file or a device, in words, as a picture and as JSON: one kind of file an entry of `KINDS`."""

from bristle.cli.shown.kinds import KINDS, Kind, kind_of

__all__ = ["KINDS", "Kind", "kind_of"]
