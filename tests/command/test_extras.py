"""Libraries that only some work needs: where one is missing, one line says which extra brings it."""

from __future__ import annotations

import sys
import tomllib
from pathlib import Path

import openpyxl
import pytest

from recordings import BadInput, bundled, write
from simulator import BASE, CATALOGUE, Value, ValveModel

HOUSE = Path(__file__).resolve().parents[2]
PROJECT = tomllib.loads((HOUSE / "pyproject.toml").read_text(encoding="utf-8"))["project"]
LIBRARIES = {
    "tls": "cryptography", "mqtt": "paho", "parquet": "pyarrow", "excel": "openpyxl", "pandas": "pandas", "fmu": "fmpy",
    "fleet": "distributed",
}  # fmt: skip
"""What is imported of each extra for users."""
OWN = ("hil.modbus.certificate_files", "hil.testing.loopback_certificates")
"""Modules of ours that import such a library, and may have been loaded."""


@pytest.fixture
def without(monkeypatch):
    """Hides the library of an extra."""

    def hide(extra: str) -> None:
        library = LIBRARIES[extra]
        for name in [one for one in sys.modules if one in OWN or one.split(".")[0] == library]:
            monkeypatch.delitem(sys.modules, name)
        for package, _, name in (one.rpartition(".") for one in OWN):  # a package keeps what was loaded of it
            monkeypatch.delattr(sys.modules.get(package), name, raising=False)
        monkeypatch.setitem(sys.modules, library, None)

    return hide


def model_file(folder: Path) -> Path:
    """A model with the typical values of the base effects."""
    declared = CATALOGUE.parameters(BASE)
    values = {name: Value(value=one.scale, unit=one.unit) for name, one in declared.items()}
    ValveModel(effects=BASE, parameters=values).write(folder / "model.json")
    return folder / "model.json"


def words(extra: str, folder: Path) -> tuple[object, ...]:
    """A command that needs an extra, with files that are there."""
    (folder / "a.parquet").write_bytes(b"PAR1" + b"x" * 50)
    openpyxl.Workbook().save(folder / "a.xlsx")
    write(folder / "a.h5", bundled("step"))
    return {
        "tls": ("serve", "--make-test-ca", folder / "ca"),
        "parquet": ("import", folder / "a.parquet", "--to", folder / "b.h5"),
        "excel": ("import", folder / "a.xlsx", "--to", folder / "b.h5"),
        "fmu": ("export", model_file(folder), "--to", "fmu", "--out", folder / "v.fmu"),
        "fleet": ("fleet", "fit", folder, "--out", folder / "r.parquet"),
    }[extra]


def test_every_extra_for_users_is_tried_here():
    assert set(PROJECT["optional-dependencies"]) - {"bench", "docs", "dev"} == set(LIBRARIES)


@pytest.mark.parametrize("extra", ["tls", "parquet", "excel", "fmu", "fleet"])
def test_a_command_names_the_extra_that_it_needs(console, tmp_path, without, extra):
    command = words(extra, tmp_path)
    without(extra)
    assert f"which is not installed; install Bristle with its extra '{extra}'" in console.refused(*command)


def test_certificates_that_are_there_need_the_extra_as_well(console, tmp_path, without):
    ca = tmp_path / "ca"
    assert console("serve", "--make-test-ca", ca).code == 0
    without("tls")
    files = ("--cert", ca / "server.pem", "--key", ca / "server.key", "--ca", ca / "ca.pem")
    said = console.refused("serve", "--listen", "tls://127.0.0.1:0", *files)
    assert "TLS needs the package cryptography, which is not installed; install Bristle with its extra 'tls'" in said


def test_a_data_frame_needs_pandas(without):
    without("pandas")
    with pytest.raises(BadInput, match="install Bristle with its extra 'pandas', or use to_arrays"):
        bundled("step").to_dataframe()
