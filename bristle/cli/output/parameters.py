"""How the command line writes the parameters that the rooms name in their messages and guesses."""

from __future__ import annotations

_OPTIONS = {
    "certificates": "--make-test-ca",
    "constraints": "--constraint",
    "column": "--column NAME=COLUMN:UNIT",
    "effects": "--effect",
    "import_to": "bristle import",
    "learn_s": "--learn",
    "priors": "--prior",
    "overwrite": "--force",
    "rate_hz": "--rate HZ",
    "settings": "--set",
    "time": "--time COLUMN:UNIT",
}
"""The options whose names are not the parameter's alone, with the form of their value where that helps."""


def shown_option(parameter: str) -> str:
    """What stands for a parameter in a message.

    >>> shown_option("rate_hz"), shown_option("time_format")
    ('--rate HZ', '--time-format')
    """
    return _OPTIONS.get(parameter, f"--{parameter.replace('_', '-')}")


def option(parameter: str) -> str:
    """The option alone, to be typed or followed by a value."""
    return shown_option(parameter).split()[0]
