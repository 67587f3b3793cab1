"""What the tables of the pages on recordings and on import list is there, and all of it is listed."""

from __future__ import annotations

import re
from pathlib import Path

from recordings import UNDERSTOOD, UNITS
from recordings.importers import mapping_names

DOCS = Path(__file__).resolve().parents[2] / "docs"
RECORDINGS = (DOCS / "recordings.md").read_text(encoding="utf-8")
IMPORT = (DOCS / "how-to" / "import.md").read_text(encoding="utf-8")


def test_every_mapping_is_listed() -> None:
    assert {name for name in mapping_names() if f"`{name}`" not in IMPORT} == set()


def test_the_units_of_the_table_are_known() -> None:
    listed = set(re.findall(r"`([^`]+)`", RECORDINGS.split("| of | units |")[1].split("##")[0]))
    assert listed
    assert listed <= set(UNITS)


def test_every_understood_signal_is_listed() -> None:
    assert {name for name in UNDERSTOOD if f"`{name}`" not in RECORDINGS} == set()
