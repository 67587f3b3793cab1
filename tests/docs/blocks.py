"""The code blocks of a page, and how each of them is run.

What a page shows is what runs here, in the order of the page and in one folder for each page:

- ``console``: lines that begin with ``$`` are commands, with what follows them up to the next one. ``bristle`` runs in
  this process, everything else in a shell, and one that ends in ``&`` in the background until the page is done.
- ``python``: a program, run in one namespace for each page; with ``>>>`` it is a doctest.
- a block whose first line is a comment with a file's name (``# rig.toml``) is that file.
- ``exit-1`` behind the language says that its commands end with exit code 1: the answer is negative.
- ``no-test`` behind the language marks a block that cannot run here; its options are held against ``--help``.
"""

from __future__ import annotations

import doctest
import os
import re
import runpy
import shlex
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
PAGES = [ROOT / name for name in ("README.md", "CONTRIBUTING.md")] + sorted((ROOT / "docs").rglob("*.md"))
FENCE = re.compile(r"^```(?P<info>[^\n`]*)\n(?P<text>.*?)^```$", re.M | re.S)
NAMED = re.compile(r"^# (?P<name>[\w-]+\.(?:py|toml|csv))$")


@dataclass(frozen=True)
class Block:
    """A fenced block. line : where it begins in the page; words : what stands behind the language."""

    page: str
    line: int
    language: str
    words: tuple[str, ...]
    text: str

    @property
    def runs(self) -> bool:
        """Whether it is run."""
        return "no-test" not in self.words

    @property
    def code(self) -> int:
        """The exit code of its commands: 1 where the page says ``exit-1``, because the answer is negative."""
        return 1 if "exit-1" in self.words else 0

    @property
    def file(self) -> str | None:
        """The name of the file that it is."""
        found = NAMED.match(self.text.partition("\n")[0])
        return found["name"] if found else None

    @property
    def commands(self) -> list[str]:
        """The commands of a console block, each with the lines that continue it."""
        parts = re.split(r"^\$ ", self.text, flags=re.M)[1:]
        return ["\n".join(_typed(part)).strip() for part in parts]


PAGE_ADDRESS = "127.0.0.1:5020"
"""Where the pages have their simulated device."""


def _typed(part: str) -> Iterator[str]:
    """The lines of a command that are typed: the first, and others while a backslash continues them."""
    for line in part.splitlines():
        yield line
        if not line.endswith("\\"):
            return


def blocks(page: Path) -> list[Block]:
    """The blocks of a page in their order."""
    text = page.read_text(encoding="utf-8")
    name = str(page.relative_to(ROOT))
    found = []
    for match in FENCE.finditer(text):
        language, *words = match["info"].split() or [""]
        found.append(Block(name, text[: match.start()].count("\n") + 1, language, tuple(words), match["text"]))
    return found


class Page:
    """Runs the blocks of a page in a folder. Use it as a context manager: it ends what runs in the background."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._names: dict[str, Any] = {}
        self._background: list[subprocess.Popen[bytes]] = []
        self._address = f"127.0.0.1:{_free_port()}"

    def __enter__(self) -> Page:
        return self

    def __exit__(self, *_: object) -> None:
        for process in self._background:
            process.terminate()
        for process in self._background:
            process.wait(20)

    def run(self, block: Block) -> None:
        """Run a block, or write it where it is a file. A port of the page is here one that nobody uses."""
        block = replace(block, text=block.text.replace(PAGE_ADDRESS, self._address))
        if block.file is not None:
            (self._folder / block.file).write_text(block.text, encoding="utf-8")
        elif block.language == "console":
            for command in block.commands:
                self._command(command, block.code, f"{block.page}:{block.line}: {command}")
        elif block.language == "python" and ">>>" in block.text:
            self._doctest(block)
        elif block.language == "python":
            program = self._folder / f"{Path(block.page).stem}-{block.line}.py"
            program.write_text(block.text, encoding="utf-8")
            self._names = runpy.run_path(str(program), self._names)

    def _command(self, command: str, expected: int, where: str) -> None:
        if command.endswith("&"):
            self._start(command.removesuffix("&"))
        elif command.startswith("bristle "):
            # The command line is asked in this process: a new one would load everything again.
            from bristle.cli.app import run

            code = run(shlex.split(command.replace("\\\n", " "))[1:])
            assert code == expected, f"{where} ends with {code}"
        elif command.startswith("make "):
            targets = re.findall(r"^(\w+):", (ROOT / "Makefile").read_text(encoding="utf-8"), re.M)
            assert set(command.split()[1:]) <= set(targets), f"{where}: the Makefile has no such target"
        else:
            done = subprocess.run(["bash", "-ec", command], cwd=self._folder, env=_environment(), check=False)
            assert done.returncode == expected, f"{where} ends with {done.returncode}"

    def _start(self, command: str) -> None:
        words = shlex.split(command)
        assert words[0] == "bristle"
        program = [sys.executable, "-c", "from bristle.cli import main; main()", *words[1:]]
        log = (self._folder / f"background-{len(self._background)}.log").open("wb")
        self._background.append(subprocess.Popen(program, cwd=self._folder, env=_environment(), stdout=log, stderr=log))
        deadline = time.monotonic() + 60
        while not Path(log.name).stat().st_size and self._background[-1].poll() is None and time.monotonic() < deadline:
            time.sleep(0.05)

    def _doctest(self, block: Block) -> None:
        test = doctest.DocTestParser().get_doctest(block.text, self._names, block.page, block.page, block.line)
        result = doctest.DocTestRunner(optionflags=doctest.ELLIPSIS).run(test, clear_globs=False)
        self._names.update(test.globs)
        assert not result.failed, f"{block.page}:{block.line}: {result.failed} of {result.attempted} examples fail"


def _free_port() -> int:
    with socket.create_server(("127.0.0.1", 0)) as listener:
        return int(listener.getsockname()[1])


def _environment() -> dict[str, str]:
    """The environment of a command: this tree's programs, and this interpreter's first on the path."""
    path = os.pathsep.join([str(Path(sys.executable).parent), os.environ.get("PATH", "")])
    return {**os.environ, "PATH": path, "PYTHONPATH": str(ROOT)}
