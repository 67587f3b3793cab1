"""The names behind `import bristle`: typed and loaded alike, each with words and an example, and cheap to have."""

from __future__ import annotations

import ast
import os
import subprocess
import sys
from importlib.metadata import version
from pathlib import Path

import pytest

import bristle as br
from benchmarks.startup import processor_ms

HOUSE = Path(__file__).resolve().parents[2]
FUNCTIONS = [name for module, names in br.PLACES.items() if module.startswith("bristle.door.") for name in names]


def typed() -> dict[str, str]:
    """Name -> module, of what the door imports for type checkers."""
    (block,) = (node for node in ast.parse(Path(br.__file__).read_text()).body if isinstance(node, ast.If))
    imports = (node for node in block.body if isinstance(node, ast.ImportFrom))
    return {alias.name: str(node.module) for node in imports for alias in node.names if alias.asname == alias.name}


def test_type_checkers_see_the_names_that_are_loaded():
    assert typed() == br.PLACE


@pytest.mark.parametrize("name", sorted(br.PLACE))
def test_every_name_is_there_and_says_what_it_is(name):
    assert name in dir(br)
    assert name in br.__all__
    assert (getattr(br, name).__doc__ or "").strip()


@pytest.mark.parametrize("name", FUNCTIONS)
def test_every_function_has_an_example(name):
    assert ">>> import bristle as br" in getattr(br, name).__doc__


@pytest.mark.parametrize("name", sorted(br.PLACE))
def test_every_name_has_an_example_that_runs_as_a_doctest(name):
    assert ">>> " in getattr(br, name).__doc__


def test_a_name_that_is_not_there_is_refused_with_those_that_are():
    with pytest.raises(AttributeError, match=r"no attribute 'fitt'; there are .*fit"):
        _ = br.fitt


def test_the_version_is_that_of_the_package():
    assert br.__version__ == version("bristle")


def test_importing_changes_nothing_in_the_process():
    program = "import os; before = dict(os.environ); import bristle; assert dict(os.environ) == before"
    subprocess.run([sys.executable, "-c", program], check=True, env=os.environ | {"PYTHONPATH": str(HOUSE)})


def test_importing_is_quick():
    assert processor_ms("-c", "import bristle") - processor_ms("-c", "pass") < 100.0
