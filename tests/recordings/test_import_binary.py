"""Import of MATLAB, HDF5 and Parquet files."""

from __future__ import annotations

import builtins
import os
from datetime import datetime
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from recording_samples import outcome
from scipy.io import savemat

from recordings import BadInput, Recording, validate, write
from recordings.importers import import_file, load_mapping, mapping_of

T = np.arange(50) / 10
X = 0.01 * np.sin(T)
F = 100 * np.cos(T)
BY_NAME: dict[str, Any] = {
    "time": {"column": "t", "unit": "s"},
    "signals": {"position": {"column": "x", "unit": "m"}, "force": {"formula": "gain * u", "unit": "N"}},
}
BY_NUMBER: dict[str, Any] = {
    "time": {"column": 1, "unit": "s"},
    "signals": {"position": {"column": 2, "unit": "m"}, "force": {"formula": "100 * #3", "unit": "N"}},
}


def check(path: Path, **mapping: Any) -> Recording:
    """The recording of a file, which must hold T, X and F."""
    made = import_file(path, mapping_of(mapping, "options")).recording
    np.testing.assert_array_equal(made.time, T)
    np.testing.assert_array_equal(made["position"].values, X)
    np.testing.assert_allclose(made["force"].values, F)
    assert made["force"].role == "input"
    write(path.with_suffix(".rec.h5"), made)
    assert validate(path.with_suffix(".rec.h5")) == []
    return made


def matlab73(path: Path, variables: dict[str, Any], **classes: bytes) -> None:
    """A file as MATLAB 7.3 writes it: a user block, transposed arrays, the class as an attribute."""
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, value in variables.items():
            dataset = file.create_dataset(name, data=np.atleast_2d(value).T)
            dataset.attrs["MATLAB_class"] = np.bytes_(classes.get(name, b"double"))
    with path.open("r+b") as raw:
        raw.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM")


VECTORS = {"t": T[:, None], "x": X[:, None], "u": F[:, None] / 100, "gain": 100.0, "note": "rig 4"}


def test_vectors_and_constants_of_old_matlab_files(tmp_path: Path) -> None:
    savemat(tmp_path / "rig.mat", VECTORS)
    made = check(tmp_path / "rig.mat", **BY_NAME)
    assert made.attributes["gain"] == 100.0
    savemat(tmp_path / "row.mat", VECTORS | {"x": X[None, :], "other": np.zeros((3, 3)), "flags": X > 0}, format="4")
    check(tmp_path / "row.mat", **BY_NAME)


def test_fields_of_a_structure(tmp_path: Path) -> None:
    savemat(tmp_path / "rig.mat", {"data": {"t": T, "x": X, "u": F / 100}, "gain": 100.0})
    signals = {"position": {"column": "data.x", "unit": "m"}, "force": {"formula": "gain*data.u", "unit": "N"}}
    check(tmp_path / "rig.mat", time={"column": "data.t", "unit": "s"}, signals=signals)


@pytest.mark.parametrize("transposed", [False, True])
def test_a_matrix_by_columns_or_rows(tmp_path: Path, transposed: bool) -> None:
    matrix = np.array([T, X, F / 100])
    savemat(tmp_path / "one.mat", {"log": matrix.T if transposed else matrix})
    check(tmp_path / "one.mat", **BY_NUMBER)
    savemat(tmp_path / "two.mat", {"log": matrix.T if transposed else matrix, "other": np.zeros((4, 4)), "v": [1, 2]})
    check(tmp_path / "two.mat", file={"variable": "log"}, **BY_NUMBER)
    with pytest.raises(BadInput, match=r"no column '2'; .* chosen as the variable: log \(\d+ x \d+\), other \(4 x 4\)"):
        check(tmp_path / "two.mat", **BY_NUMBER)
    with pytest.raises(BadInput, match=r"there is no matrix 'lag'; matrices there: log"):
        check(tmp_path / "two.mat", file={"variable": "lag"}, **BY_NUMBER)


def test_matlab_73(tmp_path: Path) -> None:
    matlab73(tmp_path / "rig.mat", VECTORS | {"note": np.array([114, 105, 103], "u2")}, note=b"char")
    made = check(tmp_path / "rig.mat", **BY_NAME)
    assert "note" not in made.attributes
    matlab73(tmp_path / "matrix.mat", {"log": np.array([T, X, F / 100])})
    check(tmp_path / "matrix.mat", **BY_NUMBER)


def test_any_hdf5_file_with_groups(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "rig.h5", "w") as file:
        file.update({"data/time [s]": T, "data/x": X, "data/u": F / 100, "gain": 100.0, "#refs#/a": [1.0, 2.0]})
    time = {"column": "data.time", "unit": "s"}
    signals = {"position": {"column": "data.x", "unit": "m"}, "force": {"formula": "gain*data.u", "unit": "N"}}
    check(tmp_path / "rig.h5", time=time, signals=signals)


def test_signals_that_differ_in_length_are_refused(tmp_path: Path) -> None:
    savemat(tmp_path / "rig.mat", VECTORS | {"x": X[1:]})
    with pytest.raises(BadInput, match="the signals differ in length: time 50, position 49, force 50; all signals"):
        check(tmp_path / "rig.mat", **BY_NAME)


def test_a_fault_names_the_sample(tmp_path: Path) -> None:
    savemat(tmp_path / "rig.mat", VECTORS | {"t": np.where(np.arange(50) == 7, 0.0, T)})
    with pytest.raises(BadInput, match=r"rig.mat: sample 8: time goes backwards: 0 s after 0.6 s"):
        check(tmp_path / "rig.mat", **BY_NAME)


@pytest.mark.slow
@given(st.lists(st.tuples(st.floats(0, 1, exclude_max=True), st.integers(0, 255)), max_size=10), st.booleans())
@settings(max_examples=60, deadline=None)
def test_damaged_matlab_files_make_a_recording_or_bad_input(
    tmp_path_factory: pytest.TempPathFactory, flips: list[tuple[float, int]], new: bool
) -> None:
    path = tmp_path_factory.getbasetemp() / "damaged.mat"
    (matlab73 if new else savemat)(path, {name: VECTORS[name] for name in ("t", "x", "u", "gain")})
    data = bytearray(path.read_bytes())
    for place, value in flips:
        data[int(place * len(data))] = value
    path.write_bytes(data)
    result = outcome(lambda: import_file(path, mapping_of(BY_NAME, "options")).recording)
    assert "\n" not in str(result)
    assert isinstance(result, BadInput) or len(result) >= 2


@pytest.mark.slow
def test_files_on_which_scipy_crashes_are_bad_input(tmp_path: Path) -> None:
    """About one in forty of these random damages ends scipy's reader with a segmentation fault."""
    savemat(tmp_path / "whole.mat", {name: VECTORS[name] for name in ("t", "x", "u", "gain")})
    whole, rng, crashed = (tmp_path / "whole.mat").read_bytes(), np.random.default_rng(0), 0
    path = tmp_path / "damaged.mat"
    for _ in range(200):
        data = bytearray(whole)
        for place in rng.integers(len(data), size=rng.integers(1, 10)):
            data[place] = rng.integers(256)
        path.write_bytes(data)
        result = outcome(lambda: import_file(path, mapping_of(BY_NAME, "options")).recording)
        assert isinstance(result, BadInput) or len(result) >= 2
        crashed += "scipy crashes on it; copy it again" in str(result)
    assert crashed


def test_scipy_reads_in_a_child_process_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A child that came to its end does not say that a second reading would."""
    savemat(tmp_path / "rig.mat", VECTORS)
    vectors = {name: np.squeeze(value) for name, value in VECTORS.items()}
    monkeypatch.setattr("scipy.io.loadmat", lambda *_, **__: {**vectors, "reader": np.array(float(os.getpid()))})
    made = import_file(tmp_path / "rig.mat", mapping_of(BY_NAME, "options")).recording
    assert made.attributes["reader"] != os.getpid()
    monkeypatch.setattr("recordings.hdf5.probe._CAN_TRY", False)
    made = import_file(tmp_path / "rig.mat", mapping_of(BY_NAME, "options")).recording
    assert made.attributes["reader"] == os.getpid()


def test_the_pulses_file_of_emps_has_one_signal_more(tmp_path: Path) -> None:
    volts = F / 35.15065188
    content = {"t": T, "qm": X, "qg": X, "vir": volts, "gtau": 35.15065188, "kp": 160.18, "kv": 243.45}
    savemat(tmp_path / "DATA_EMPS.mat", content)
    savemat(tmp_path / "DATA_EMPS_PULSES.mat", content | {"pulses_N": 5.0 * (T > 2)})
    plain = import_file(tmp_path / "DATA_EMPS.mat", load_mapping("emps")).recording
    pulses = import_file(tmp_path / "DATA_EMPS_PULSES.mat", load_mapping("emps")).recording
    assert set(pulses) - set(plain) == {"pulses"}
    assert (pulses["pulses"].unit, pulses["pulses"].values.max()) == ("V", 5.0)
    np.testing.assert_allclose(pulses["force"].values, F)


def test_parquet(tmp_path: Path) -> None:
    pa, pq = pytest.importorskip("pyarrow"), pytest.importorskip("pyarrow.parquet")
    stamps = [datetime(2026, 11, 21, 9, 30, 0, 100_000 * k) for k in range(3)]
    table = pa.table({"when": stamps, "position [mm]": [1, None, 3], "force [N]": [1.5, 2.5, 3.5], "note": list("abc")})
    pq.write_table(table, tmp_path / "rig.parquet")
    result = import_file(tmp_path / "rig.parquet", mapping_of({"time": {"column": "when"}}, "options"))
    np.testing.assert_allclose(result.recording.time, [0, 0.1, 0.2])
    np.testing.assert_allclose(result.recording["position"].values, [1e-3, np.nan, 3e-3])
    assert result.notes == ("columns without numbers were left out: note",)
    named = {"time": {"column": "when"}, "signals": {"force": {"column": "note", "unit": "N"}}}
    with pytest.raises(BadInput, match="'a value of the type string' in column 'note' is not a number; only columns"):
        import_file(tmp_path / "rig.parquet", mapping_of(named, "options"))
    (tmp_path / "rig.parquet").write_bytes(b"PAR1" + b"x" * 50)
    with pytest.raises(BadInput, match="it cannot be read as Parquet"):
        import_file(tmp_path / "rig.parquet")


def test_parquet_without_pyarrow_says_what_to_install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "rig.parquet").write_bytes(b"PAR1" + b"x" * 50)
    load = builtins.__import__

    def without_pyarrow(name: str, *rest: Any) -> Any:
        if name.startswith("pyarrow"):
            raise ImportError(name)
        return load(name, *rest)

    monkeypatch.setattr(builtins, "__import__", without_pyarrow)
    with pytest.raises(BadInput, match="the package pyarrow, which is not installed; install Bristle with its extra"):
        import_file(tmp_path / "rig.parquet")


def external_link(file: h5py.File, other: Path) -> None:
    file["position"] = h5py.ExternalLink(str(other), "secret")


def external_storage(file: h5py.File, other: Path) -> None:
    file.create_dataset("position", (8,), "f8", external=[(str(other), 0, 64)])


def virtual(file: h5py.File, other: Path) -> None:
    layout = h5py.VirtualLayout((8,), "f8")
    layout[:] = h5py.VirtualSource(str(other), "secret", (8,))
    file.create_virtual_dataset("position", layout)


@pytest.mark.parametrize("trick", [external_link, external_storage, virtual])
def test_no_byte_of_another_file_is_imported(tmp_path, trick):
    other = tmp_path / "other.h5"
    with h5py.File(other, "w") as file:
        file["secret"] = np.arange(8.0)
    path = tmp_path / "trap.mat"
    with h5py.File(path, "w") as file:
        file["time"] = np.arange(8.0)
        trick(file, other)
    with pytest.raises(BadInput, match="another file"):
        import_file(path)
