"""The page on adding an effect: its example runs, and its effect keeps the contract. And the page of the catalogue."""

from __future__ import annotations

import doctest
from pathlib import Path

from effect_contract import CHECKS, Subject

from simulator import CATALOGUE, Effect
from tools.effects_table import section

DOCS = Path(__file__).resolve().parents[3] / "docs"
PAGE, CATALOGUE_PAGE = DOCS / "extending.md", DOCS / "effects.md"


def test_the_worked_example_runs_and_keeps_the_contract():
    parser = doctest.DocTestParser()
    example = parser.get_doctest(PAGE.read_text(encoding="utf-8").replace("```", ""), {}, PAGE.name, str(PAGE), 0)
    assert len(example.examples) > 8
    results = doctest.DocTestRunner().run(example, clear_globs=False)
    assert results.failed == 0
    effect = example.globs["Magnet"]()
    for check in CHECKS:
        check(Subject(effect, CATALOGUE.extended(effect)))


def test_the_page_names_every_hook():
    text = PAGE.read_text(encoding="utf-8")
    hooks = [name for name in vars(Effect) if not name.startswith("_") and callable(getattr(Effect, name))]
    missing = [hook for hook in hooks if f"`{hook}(" not in text and not hook.startswith("parameter_name")]
    assert missing == []


def test_the_page_has_the_tables_of_the_catalogue():
    text = CATALOGUE_PAGE.read_text(encoding="utf-8")
    assert text.endswith(section()), "the catalogue changed: run python -m tools.effects_table"
    assert all(f"| `{effect}` |" in text for effect in CATALOGUE.ids)
