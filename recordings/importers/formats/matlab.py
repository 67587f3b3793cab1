"""Reading MATLAB files into a table: versions 4 to 7 through scipy, 7.3 and any other HDF5 file through h5py."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from recordings.arrays import Array
from recordings.column_headers import named_columns
from recordings.errors import BadInput
from recordings.hdf5.items import check_size, is_plain, own_item
from recordings.hdf5.opening import open_hdf5, starts_like_hdf5
from recordings.hdf5.probe import probe
from recordings.hdf5.problems import h5py_errors
from recordings.importers.file_format import FileFormat, Match
from recordings.importers.formats.matlab_content import content_of
from recordings.importers.formats.matlab_size import check_unpacked
from recordings.importers.mapping import FileLayout
from recordings.importers.table import ForeignTable, check_expansion

Variables = dict[str, Array]


def read_mat(path: Path, variable: str | None = None) -> ForeignTable:
    """Read a MATLAB file of version 4, 5, 6 or 7.

    Vectors become columns of their name, single numbers become constants, fields of a structure are called
    ``structure.field``. A matrix becomes columns numbered from 1, along its shorter side: the one named `variable`, or
    the only one when there are no vectors.

    Raises
    ------
    BadInput
        The file is damaged, or there is no such variable.
    """
    from scipy.io import loadmat

    def reading() -> dict[str, NDArray[Any]]:
        content = loadmat(path, squeeze_me=True, struct_as_record=False, chars_as_strings=True)
        return dict(_from_scipy({name: value for name, value in content.items() if not name.startswith("__")}))

    check_unpacked(path)
    try:
        variables = {name: np.asarray(value, np.float64) for name, value in content_of(path, reading).items()}
    except BadInput:
        raise
    except Exception as error:
        found = f"it cannot be read as a MATLAB file ({' '.join(str(error).split())[:120]})"
        raise BadInput(str(path), found, "copy it again from its origin, or save it as CSV") from error
    return _table(str(path), variables, variable)


def read_mat73(path: Path, variable: str | None = None) -> ForeignTable:
    """Read a MATLAB file of version 7.3, or any HDF5 file with datasets at its root or a group below; as `read_mat`."""
    probe(path, lambda: _list_hdf5(path))
    with open_hdf5(path) as file, h5py_errors(str(path)):
        variables = {}
        found = list(_datasets(file))
        check_expansion(path, sum(dataset.size for _, dataset in found), len(found))
        for name, dataset in found:
            check_size(dataset, f"{path}: {name}")
            variables[name] = np.squeeze(np.asarray(dataset[()], np.float64))
    return _table(str(path), variables, variable)


def _match_mat(path: Path, head: bytes) -> Match:
    if head[:6] == b"MATLAB" and not starts_like_hdf5(path):
        return Match.CONTENT
    return Match.NAME if path.suffix.lower() == ".mat" else Match.NO


def _match_hdf5(path: Path, head: bytes) -> Match:
    return Match.CONTENT if starts_like_hdf5(path) else Match.NO


def _read_mat(path: Path, layout: FileLayout, texts: Sequence[str | int]) -> ForeignTable:
    return read_mat(path, layout.variable)


def _read_hdf5(path: Path, layout: FileLayout, texts: Sequence[str | int]) -> ForeignTable:
    return read_mat73(path, layout.variable)


MAT = FileFormat("MATLAB 4 to 7", _match_mat, _read_mat)
HDF5 = FileFormat("HDF5 and MATLAB 7.3", _match_hdf5, _read_hdf5)


def _list_hdf5(path: Path) -> None:
    with open_hdf5(path) as file:
        list(_datasets(file))


def _from_scipy(content: Mapping[str, Any]) -> Iterator[tuple[str, NDArray[Any]]]:
    for name, value in content.items():
        if hasattr(value, "_fieldnames"):
            yield from _from_scipy({f"{name}.{field}": getattr(value, field) for field in value._fieldnames})
        elif np.asarray(value).dtype.kind in "biuf":
            yield name, np.asarray(value)


def _datasets(group: h5py.Group, prefix: str = "") -> Iterator[tuple[str, h5py.Dataset]]:
    """The numeric datasets of a group and, with the group's name before theirs, of the groups in it."""
    check_expansion(Path(group.file.filename), 0, len(group))  # before thousands are looked at
    for name in group:
        if name.startswith("#"):  # where MATLAB keeps what its cells point to
            continue
        item = own_item(group, name, f"{group.file.filename}: {prefix}{name}")
        if isinstance(item, h5py.Group) and not prefix:
            yield from _datasets(item, f"{name}.")
        elif isinstance(item, h5py.Dataset) and item.dtype.kind in "iuf" and is_plain(item.id) and _holds_numbers(item):
            yield prefix + name, item


def _holds_numbers(dataset: h5py.Dataset) -> bool:
    """MATLAB stores text and empty arrays as numbers too, and says so in attributes."""
    return dataset.attrs.get("MATLAB_class") != b"char" and "MATLAB_empty" not in dataset.attrs


def _table(where: str, variables: Variables, chosen: str | None) -> ForeignTable:
    constants = {name: float(value.reshape(())) for name, value in variables.items() if value.size == 1}
    vectors = {name: value for name, value in variables.items() if value.ndim == 1 and value.size > 1}
    matrices = {name: value for name, value in variables.items() if value.ndim == 2 and value.size > 1}
    if chosen is not None and chosen not in matrices:
        found = f"there is no matrix '{chosen}'"
        raise BadInput(where, found, f"matrices there: {_shapes(matrices) or 'none'}")
    if chosen is None and len(matrices) == 1 and not vectors:
        chosen = next(iter(matrices))
    headers, columns = list(vectors), [*vectors.values()]
    if chosen is not None:
        matrix = matrices[chosen]
        rows = matrix if matrix.shape[0] <= matrix.shape[1] else matrix.T
        headers, columns = [str(k + 1) for k in range(len(rows))] + headers, [*rows, *columns]
    names, units = named_columns(headers)
    hint = f"; a matrix can be chosen as the variable: {_shapes(matrices)}" if matrices and chosen is None else ""
    by_name = {name: np.ascontiguousarray(column) for name, column in zip(names, columns, strict=True)}
    return ForeignTable(where, by_name, units, constants, row_word="sample", hint=hint)


def _shapes(matrices: Variables) -> str:
    return ", ".join(f"{name} ({matrix.shape[0]} x {matrix.shape[1]})" for name, matrix in matrices.items())
