"""``--holdout A B`` as ``--holdout A --holdout B``: the parser would silently take B for a recording to fit."""

from __future__ import annotations

from collections.abc import Collection, Sequence

SEVERAL = ("--holdout", "--report-on")
"""Options that take all words up to the next option."""


def spelled_out(words: Sequence[str], flags: Collection[str]) -> list[str]:
    """The words of a command, with each of `SEVERAL` repeated for all words behind it.

    flags : options of the command that take no word. Where that would leave nothing for the command itself, the option
    takes one word only, as others do: ``fit --holdout c.h5 a.h5`` fits a.h5. With two such options nobody can tell, and
    the parser says what is missing.

    >>> spelled_out(["fit", "a.h5", "--holdout", "b.h5", "c.h5"], ())
    ['fit', 'a.h5', '--holdout', 'b.h5', '--holdout', 'c.h5']
    >>> spelled_out(["fit", "--holdout", "c.h5", "a.h5", "--out", "m.json"], ())
    ['fit', '--holdout', 'c.h5', 'a.h5', '--out', 'm.json']
    """
    spelled: list[str] = []
    option: str | None = None
    n_free, further = 0, list[int]()
    for word in words:
        follows = spelled[-1] if spelled else None
        if word.startswith("-"):
            option = word
        elif option in SEVERAL and follows != option:
            further.append(len(spelled))
            spelled.append(str(option))
        elif option is None or option in flags or follows != option or "=" in option:
            n_free += 1
        spelled.append(word)
    if n_free > 1 or not further or len({spelled[place] for place in further}) > 1:  # the first is the command itself
        return spelled
    return [word for place, word in enumerate(spelled) if place not in further]
