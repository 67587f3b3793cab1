"""What is built at run time: which compiler, where it is kept, and what happens when things are broken."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import casadi as ca
import numpy as np
import pytest

from simulator import Recurrence, Scanner
from simulator.compile import c_compiler
from simulator.compile.c_compiler import FLAGS, BuildFailed, compiler, shared_library
from simulator.compile.cache import artefact, directory

SOURCE = "int answer(void) { return 42; }"
needs_compiler = pytest.mark.skipif(compiler() is None, reason="there is no C compiler on this machine")


@pytest.fixture
def cache(tmp_path, monkeypatch):
    """An empty cache of this test."""
    monkeypatch.setenv("BRISTLE_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache"


def scanner():
    s, e, p = ca.SX.sym("s"), ca.SX.sym("e", 3), ca.SX.sym("p")
    return Scanner(Recurrence(s, e, p, s + e[1] * p * e[2], s))


def works(scanner):
    scan = scanner.run(np.arange(4.0), np.ones(4), np.array([2.0]), np.zeros(1))
    return scan.outputs[:, 0].tolist() == [0, 2, 4, 6]


def script(path, text):
    """An executable shell script."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(f"#!/bin/sh\n{text}\n")
    path.chmod(0o755)
    return path


def build_once(folder: Path):
    (folder / "part").mkdir()
    (folder / "part" / "file").write_text("content")


def never(folder: Path):
    raise AssertionError("this is in the cache and must not be built")


class TestCache:
    def test_what_was_built_is_kept_in_private_folders(self, cache):
        folder = artefact("key", build_once)
        assert folder.parent == cache == directory()
        assert artefact("key", never) == folder
        assert artefact("another key", build_once) != folder
        assert cache.stat().st_mode & 0o777 == 0o700
        assert folder.stat().st_mode & 0o777 == 0o700
        assert not list(cache.glob("build-*"))

    @pytest.mark.parametrize("damage", ["cut", "changed", "removed", "added", "seal cut", "seal removed", "a file"])
    def test_what_is_damaged_is_built_again(self, cache, damage):
        folder = artefact("key", build_once)
        file, seal = folder / "part" / "file", folder / "SHA256"
        {
            "cut": lambda: file.write_text("con"),
            "changed": lambda: file.write_text("Content"),
            "removed": file.unlink,
            "added": lambda: (folder / "more").write_text(""),
            "seal cut": lambda: seal.write_bytes(b"\xff"),
            "seal removed": seal.unlink,
            "a file": lambda: (shutil.rmtree(folder), folder.write_text("")),
        }[damage]()
        again = artefact("key", build_once)
        assert (again / "part" / "file").read_text() == "content"
        assert sorted(path.name for path in again.iterdir()) == ["SHA256", "part"]

    def test_a_failed_build_leaves_nothing(self, cache):
        with pytest.raises(AssertionError):
            artefact("key", never)
        assert not list(cache.iterdir())

    def test_leftovers_of_killed_processes_are_removed(self, cache):
        artefact("key", build_once)
        (cache / "build-old").mkdir()
        os.utime(cache / "build-old", (0, 0))
        (cache / "build-new").mkdir()
        artefact("another key", build_once)
        assert [path.name for path in cache.glob("build-*")] == ["build-new"]

    @pytest.mark.parametrize("mode", [0o770, 0o777, 0o707, 0o1777])
    def test_a_folder_that_others_can_write_to_is_not_used(self, cache, mode):
        cache.mkdir()
        cache.chmod(mode)
        folder = artefact("key", build_once)
        assert cache not in folder.parents
        assert not list(cache.iterdir())

    def test_a_folder_that_others_could_exchange_is_not_used(self, tmp_path, monkeypatch):
        (tmp_path / "open").mkdir()
        (tmp_path / "open").chmod(0o777)
        monkeypatch.setenv("BRISTLE_CACHE", str(tmp_path / "open" / "cache"))
        assert tmp_path not in artefact("key", build_once).parents

    @pytest.mark.skipif(os.getuid() != 0, reason="only root can give a folder to somebody else")
    def test_a_folder_of_somebody_else_is_not_used(self, cache):
        folder = artefact("key", build_once)
        os.chown(folder, 12345, 12345)
        assert artefact("key", build_once).stat().st_uid == os.getuid()
        os.chown(cache, 12345, 12345)
        assert cache not in artefact("key", build_once).parents

    @pytest.mark.skipif(os.getuid() != 0, reason="only root can give a folder to somebody else")
    @pytest.mark.parametrize(("mode", "owner", "group"), [(0o755, 12345, 0), (0o775, 0, 12345)])
    def test_a_folder_under_one_of_somebody_else_is_not_used(self, tmp_path, monkeypatch, mode, owner, group):
        above = tmp_path / "above"
        above.mkdir()
        above.chmod(mode)
        os.chown(above, owner, group)
        monkeypatch.setenv("BRISTLE_CACHE", str(above / "cache"))
        assert above not in artefact("key", build_once).parents

    @pytest.mark.parametrize("place", ["/dev/null/cache", "/proc/cache", "{tmp}/file"])
    def test_where_nothing_can_be_kept_a_folder_of_the_process_serves(self, tmp_path, monkeypatch, place):
        (tmp_path / "file").write_text("")
        monkeypatch.setenv("BRISTLE_CACHE", place.format(tmp=tmp_path))
        folder = artefact("a key for this process", build_once)
        assert (folder / "part" / "file").read_text() == "content"
        assert artefact("a key for this process", never) == folder
        assert folder.parent.stat().st_mode & 0o777 == 0o700

    def test_without_a_home_a_folder_of_the_process_serves(self, monkeypatch):
        monkeypatch.delenv("BRISTLE_CACHE", raising=False)
        monkeypatch.delenv("XDG_CACHE_HOME", raising=False)
        monkeypatch.setenv("HOME", "/dev/null")
        assert (artefact("key", build_once) / "part" / "file").exists()


@needs_compiler
class TestCompiler:
    def test_a_library_is_compiled_once(self, cache, monkeypatch):
        command = compiler()
        assert shared_library(command, SOURCE).answer() == 42
        before = sorted(cache.rglob("*.so"))
        monkeypatch.setattr("simulator.compile.c_compiler._compile", never)
        assert shared_library(command, SOURCE).answer() == 42
        assert sorted(cache.rglob("*.so")) == before
        assert len(before) == 1

    def test_sources_become_one_library_and_one_that_libraries_share_is_compiled_once(self, cache, monkeypatch):
        compiled, compile_ = [], c_compiler._compile

        def noted(command, source, *more):
            compiled.append(source)
            compile_(command, source, *more)

        monkeypatch.setattr(c_compiler, "_compile", noted)
        shared = "int part(void); int twice(void) { return 2 * part(); }"
        parts = [f"int part(void) {{ return {number}; }}" for number in (21, 4)]
        assert [shared_library(compiler(), part, shared).twice() for part in parts] == [42, 8]
        assert [shared_library(compiler(), part, shared).twice() for part in parts] == [42, 8]
        assert compiled == [parts[0], shared, parts[1]]

    def test_parts_that_do_not_fit_are_a_failed_build(self, cache):
        with pytest.raises(BuildFailed, match="failed"):
            shared_library(compiler(), "int part(void) { return 1; }", "int part(void) { return 2; }")

    def test_the_flags_and_the_compiler_are_part_of_the_key(self, cache, monkeypatch):
        command = compiler()
        shared_library(command, SOURCE)
        shared_library((*command, "-g"), SOURCE)
        monkeypatch.setattr("simulator.compile.c_compiler.FLAGS", (*FLAGS, "-DMORE"))
        shared_library(command, SOURCE)
        assert len(list(cache.rglob("*.so"))) == 3

    @pytest.mark.parametrize("length", [0, 100, 4000, -1])
    def test_a_truncated_library_is_compiled_again(self, cache, length):
        shared_library(compiler(), SOURCE)
        (library,) = cache.rglob("*.so")
        whole = library.read_bytes()
        library.unlink()  # a new file: this process goes on with the old one
        library.write_bytes(whole[:length])
        program = f"from simulator.compile.c_compiler import *; print(shared_library(compiler(), {SOURCE!r}).answer())"
        done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
        assert (done.returncode, done.stdout) == (0, "42\n"), done.stderr

    def test_a_compiler_may_lie_behind_spaces_and_have_options(self, cache, tmp_path, monkeypatch):
        real = " ".join(compiler())
        path = script(tmp_path / "my compilers" / "a cc", f'exec {real} "$@"')
        monkeypatch.setenv("CC", str(path))
        assert compiler() == (str(path),)
        assert shared_library(compiler(), SOURCE).answer() == 42
        monkeypatch.setenv("CC", f"'{path}' -DX=1 -O1")
        assert compiler() == (str(path), "-DX=1", "-O1")
        assert shared_library(compiler(), SOURCE).answer() == 42

    def test_what_names_no_compiler_is_passed_over(self, monkeypatch):
        monkeypatch.delenv("CC", raising=False)
        usual = compiler()
        for wish in ("", "no-such-compiler", "'unfinished"):
            monkeypatch.setenv("CC", wish)
            assert compiler() == usual

    @pytest.mark.parametrize(
        ("text", "said"),
        [
            ("exit 1", "exit code 1, no message"),
            ("echo cannot find crt1.o >&2; exit 1", "cannot find crt1.o"),
            ("exit 0", "no message"),
            ('for last; do :; done; while [ "$1" != -o ]; do shift; done; echo junk > "$2"', "cannot be loaded"),
        ],
        ids=["fails", "complains", "makes nothing", "makes junk"],
    )
    def test_a_broken_compiler_is_named(self, cache, tmp_path, monkeypatch, text, said):
        path = script(tmp_path / "cc", f'[ "$1" = --version ] && exit 0\n{text}')
        monkeypatch.setenv("CC", str(path))
        with pytest.raises(BuildFailed, match=said):
            shared_library(compiler(), SOURCE)

    @pytest.mark.slow
    def test_a_compiler_that_cannot_start_is_not_needed(self, cache, tmp_path, monkeypatch, caplog):
        (tmp_path / "cc").write_bytes(b"\x7fELF nonsense")
        (tmp_path / "cc").chmod(0o755)
        monkeypatch.setenv("CC", str(tmp_path / "cc"))
        made = scanner()
        assert not made.compiled
        assert works(made)
        assert "cannot be run" in caplog.text
        assert "going on without a C compiler" in caplog.text

    def test_only_what_is_run_is_compiled(self, cache):
        made = scanner()
        assert not list(cache.glob("*/kernel.so"))
        assert works(made)
        assert len(list(cache.glob("*/kernel.so"))) == 1
        scan = made.run(np.arange(4.0), np.ones(4), np.array([2.0]), np.zeros(1), sensitivities=True)
        assert scan.jacobian[:, 0].tolist() == [[0, 1], [1, 1], [2, 1], [3, 1]]
        assert works(made)
        assert len(list(cache.glob("*/kernel.so"))) == 2

    def test_a_library_lives_in_a_folder_of_the_process_when_home_is_read_only(self, monkeypatch):
        monkeypatch.setenv("BRISTLE_CACHE", "/dev/null/cache")
        assert works(scanner())


PROGRAM = """
import sys
import casadi as ca, numpy as np
from simulator import Recurrence, Scanner
s, e, p = ca.SX.sym("s"), ca.SX.sym("e", 3), ca.SX.sym("p")
scanner = Scanner(Recurrence(s, e, p, s + e[1] * p * e[2], s))
scan = scanner.run(np.arange(4.0), np.ones(4), np.array([2.0]), np.zeros(1))
print(scan.outputs[:, 0].tolist(), "numba" in sys.modules)
"""


def start():
    """A new process that makes and runs a kernel, and may write bytecode wherever Python likes to."""
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
    return subprocess.Popen(
        [sys.executable, "-c", PROGRAM], env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        cwd=Path(__file__).parents[3],
    )  # fmt: skip


@pytest.mark.slow
def test_processes_that_build_the_same_at_the_same_time_both_get_it(cache, way):
    processes = [start() for _ in range(2)]
    results = [process.communicate() for process in processes]
    for process, (said, complained) in zip(processes, results, strict=True):
        assert process.returncode == 0, complained
        assert said == f"[0.0, 2.0, 4.0, 6.0] {way == 'numba'}\n"
        assert complained == ""
    assert len([path for path in cache.iterdir() if not path.name.startswith("build-")]) == 1
    assert not list(cache.glob("build-*"))


@pytest.mark.slow
def test_machine_code_of_numba_is_kept_for_the_next_process_and_made_again_when_damaged(cache, monkeypatch, tmp_path):
    monkeypatch.setenv("BRISTLE_NO_COMPILER", "1")
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "elsewhere"))
    assert works(scanner())
    kept = {path: path.stat().st_mtime_ns for path in cache.rglob("*") if path.is_file()}
    assert {path.suffix for path in kept} == {"", ".py", ".nbi", ".nbc"}
    said, complained = start().communicate()
    assert said == "[0.0, 2.0, 4.0, 6.0] True\n", complained
    assert {path: path.stat().st_mtime_ns for path in cache.rglob("*") if path.is_file()} == kept
    assert not (tmp_path / "elsewhere").exists()
    for path in cache.rglob("*.nb[ic]"):
        path.write_bytes(path.read_bytes()[:-20])
    said, complained = start().communicate()
    assert said == "[0.0, 2.0, 4.0, 6.0] True\n", complained


def test_an_operation_that_needs_a_compiler_is_named_where_there_is_none(cache, monkeypatch):
    monkeypatch.setenv("BRISTLE_NO_COMPILER", "1")
    s, e, p = ca.SX.sym("s"), ca.SX.sym("e", 3), ca.SX.sym("p")
    with pytest.raises(NotImplementedError, match="OP_ERFINV"):
        Scanner(Recurrence(s, e, p, ca.erfinv(s), s))
