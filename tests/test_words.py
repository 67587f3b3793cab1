"""Words of the command line stay in the command line: a room names its parameters, and the command adds the options."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator

import pytest
from test_imports import ARROWS, HOUSE, MODULES

OPTION = re.compile(r"(?:^|[\s('`\"])--[a-z]")
COMMAND = re.compile(r"bristle [a-z-]+(?: --[a-z-]+(?: \w+)?)*")
"""A whole command, as advice to an operator may name it."""

COMMAND_LINES = ("bristle/cli/", "bristle/pytest_plugin.py")
"""Where a command line is spoken: our own, and pytest's, to which the plugin adds."""

OTHERS = {("simulator/compile/c_compiler.py", "--version")}
"""Options of other programs than `bristle`."""


def spoken(source: str) -> Iterator[str]:
    """Text that a module can say: its strings, but not its docstrings."""
    tree = ast.parse(source)
    silent = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in silent:
            yield node.value


def names_an_option(text: str) -> bool:
    """Whether a text names an option outside of a whole command."""
    return OPTION.search(COMMAND.sub("", text)) is not None


@pytest.mark.parametrize(
    ("source", "found"),
    [
        ('raise BadInput(a, b, "give --area, or")', True),
        ('f"hold what is known (--given {name})"', True),
        ('option = "--given"', True),
        ('check = "compare with a test: bristle test --kind signature"', False),
        ('"""Text of a module: `--given`."""', False),
        ('text = "a--b", "x -- y", "---"', False),
    ],
)
def test_options_are_told_from_other_text(source, found):
    assert any(map(names_an_option, spoken(source))) == found


def test_no_room_says_an_option_of_the_command_line():
    said = {
        (place, text)
        for path in MODULES
        if (place := path.relative_to(HOUSE).as_posix()).split("/")[0] in ARROWS and not place.startswith(COMMAND_LINES)
        for text in spoken(path.read_text(encoding="utf-8"))
        if names_an_option(text)
    }
    assert said == OTHERS
