"""Every command and every program in the README and on the pages runs, in the order in which a reader meets them."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest
from blocks import PAGES, ROOT, Block, Page, blocks
from page_files import FILES, LEFT

from bristle.cli.app import COMMANDS, run

DEVICE, MINUTES, SHELL, DATA = "needs a device", "takes minutes", "changes the shell", "needs data that are not here"
README = "runs in the README"
OWN_TEST = "runs in tests/door/test_pytest_plugin.py"
NOT_RUN = {
    "CONTRIBUTING.md": [MINUTES, MINUTES],
    "docs/how-to/assess.md": [DATA],
    "docs/how-to/evaluate.md": [MINUTES, MINUTES],
    "docs/how-to/fit.md": [DATA, DATA],
    "docs/how-to/page.md": [DEVICE, DEVICE],
    "docs/how-to/hil-tests.md": [OWN_TEST, OWN_TEST, OWN_TEST],
    "docs/how-to/record.md": [DEVICE],
    "docs/how-to/service.md": [DEVICE],
    "docs/how-to/trace.md": [README],
    "docs/how-to/watch.md": [DEVICE],
    "docs/studies/hostile.md": [MINUTES],
    "docs/studies/real-measurements.md": [DATA, DATA],
    "docs/studies/service.md": [MINUTES, MINUTES, MINUTES],
    "docs/tutorial.md": [SHELL],
}
"""Why the blocks of a page that are marked `no-test` do not run, one reason for each. Their options are tested."""

DEAR = {
    "README.md", "docs/how-to/compare.md", "docs/how-to/fit.md", "docs/how-to/next-test.md", "docs/how-to/record.md",
    "docs/how-to/serve.md", "docs/how-to/service.md", "docs/how-to/trace.md", "docs/how-to/watch.md",
    "docs/tutorial.md",
}  # fmt: skip
"""Pages whose fits, traces, simulations and services take many seconds; other tests make shorter ones by default."""

TEXTS = {"console", "python", "c", "toml", "csv", "json", "yaml", "text"}
LANGUAGES = TEXTS | {"{toctree}", "{eval-rst}", "{image}", "{literalinclude}"}
RUN = {
    str(page.relative_to(ROOT)): page
    for page in PAGES
    if any(block.runs and block.language in ("console", "python") for block in blocks(page))
}
ALL = [block for page in PAGES for block in blocks(page)]


@pytest.mark.parametrize("name", [pytest.param(one, marks=pytest.mark.slow if one in DEAR else ()) for one in RUN])
def test_the_blocks_of_a_page_run(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    FILES.get(name, lambda folder: None)(tmp_path)
    with Page(tmp_path) as started:
        for block in blocks(RUN[name]):
            if block.runs:
                started.run(block)
    LEFT.get(name, lambda folder: None)(tmp_path)


def test_the_readme_has_commands() -> None:
    shown = [
        words for block in ALL if block.page == "README.md" and block.language == "console" for words in commands(block)
    ]
    assert len(shown) >= 6


def test_every_block_that_does_not_run_has_a_reason() -> None:
    marked: dict[str, int] = {}
    for block in ALL:
        if not block.runs:
            marked[block.page] = marked.get(block.page, 0) + 1
    assert marked == {page: len(reasons) for page, reasons in NOT_RUN.items()}


def commands(block: Block) -> list[list[str]]:
    """The words of the `bristle` commands of a block."""
    words = [shlex.split(command.removesuffix("&").replace("\\\n", " ")) for command in block.commands]
    return [line[1:] for line in words if line[0] == "bristle"]


@pytest.mark.parametrize("block", [b for b in ALL if not b.runs and b.language == "console"], ids=lambda b: f"{b.page}")
def test_the_options_of_a_command_that_does_not_run_exist(block: Block, capsys: pytest.CaptureFixture[str]) -> None:
    for command, *words in commands(block):
        assert run([command, "--help"]) == 0
        known = set(re.findall(r"--[a-z][a-z-]*", capsys.readouterr().out))
        assert {word for word in words if word.startswith("--")} <= known


def test_every_block_is_of_a_language_that_is_tested() -> None:
    assert {f"{b.page}:{b.line}: {b.language or 'none'}" for b in ALL if b.language not in LANGUAGES} == set()


def test_the_options_that_pages_name_in_a_sentence_exist(capsys: pytest.CaptureFixture[str]) -> None:
    known = {"--force", "--help", "--out", "--main", "--bristle-artifacts", "--bristle-plant"}
    for command in ((), *((name,) for name in COMMANDS)):
        assert run([*command, "--help"]) == 0
        known |= set(re.findall(r"--[a-z][a-z-]*", capsys.readouterr().out))
    for page in PAGES:
        prose = re.sub(r"^```.*?^```$", "", page.read_text(encoding="utf-8"), flags=re.M | re.S)
        for span in re.findall(r"`([^`]*)`", prose):
            if "python -m" not in span and not page.is_relative_to(ROOT / "docs" / "studies"):
                unknown = set(re.findall(r"(?<![\w-])--[a-z][a-z-]*", span)) - known
                assert not unknown, f"{page.name}: {span}"


def test_the_program_of_a_figure_has_the_options_that_are_given() -> None:
    programs = {"benchmarks": ROOT / "benchmarks", "studies": ROOT / "studies", "tools": ROOT / "tools"}
    for page in PAGES:
        for module, rest in re.findall(
            r"`python -m ((?:benchmarks|studies|tools)\.\w+)([^`]*)`", page.read_text("utf-8")
        ):
            folder, name = module.split(".")
            at = programs[folder] / name
            places = (at / "__main__.py", at / "__init__.py", at.with_suffix(".py"))
            source = next(place for place in places if place.exists()).read_text(encoding="utf-8")
            options = set(re.findall(r"--[a-z]+(?:-[a-z]+)*", rest))
            assert {option for option in options if f'"{option}"' not in source} == set(), f"{page.name}: {module}"


@pytest.mark.parametrize("name", ["README.md", "CONTRIBUTING.md", "CHANGELOG.md"])
def test_the_links_of_a_page_outside_the_site_lead_to_files(name: str) -> None:
    links = re.findall(r"\]\((?!http)([^)#]+)", (ROOT / name).read_text(encoding="utf-8"))
    assert [link for link in links if not (ROOT / link).exists()] == []


def test_every_example_is_on_its_page() -> None:
    shown = set(re.findall(r"examples/(\w+)\.py", (ROOT / "docs" / "examples.md").read_text(encoding="utf-8")))
    assert shown - {"NAME"} == {path.stem for path in (ROOT / "examples").glob("*.py")}
