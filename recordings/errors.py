"""The two ways a command ends badly, kept apart by type: the input was bad, or the answer is negative."""

from __future__ import annotations


class BadInput(ValueError):
    """Something the user gave cannot be used; the command line prints it as one line and exits with 2.

    Parameters
    ----------
    where : str
        File and item, most general first: ``"rec.h5: /signals/time"``.
    found : str
        What is there.
    remedy : str
        What is allowed, or what to do.

    >>> str(BadInput("rec.h5: /signals/time", "the time goes backwards at sample 7", "sort the rows by time"))
    'rec.h5: /signals/time: the time goes backwards at sample 7; sort the rows by time'
    """

    def __init__(self, where: str, found: str, remedy: str) -> None:
        self.where, self.found, self.remedy = where, found, remedy
        super().__init__(" ".join(f"{where}: {found}; {remedy}".split()))

    def __reduce__(self) -> tuple[type[BadInput], tuple[str, str, str]]:
        """Pickle by the three parts, so that a worker process can send it home."""
        return type(self), (self.where, self.found, self.remedy)


class NegativeAnswer(Exception):
    """The command did its work and the answer is negative; the command line prints it and exits with 1."""
