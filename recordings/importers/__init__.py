"""Import: recordings from files that other programs wrote.

>>> import tempfile
>>> from pathlib import Path
>>> table = Path(tempfile.mkdtemp()) / "rig.csv"
>>> _ = table.write_text("time [ms],stem [mm],thrust [kN]\\n0,1.0,0.2\\n10,1.5,0.3\\n")
>>> signals = {"position": {"column": "stem"}, "force": {"column": 3}}
>>> mapping = mapping_of({"signals": signals}, "example")
>>> recording = import_file(table, mapping).recording
>>> recording["force"].values, recording["force"].unit, recording["force"].role
(array([200., 300.]), 'N', 'input')
"""

from __future__ import annotations

import hashlib
import shutil
from collections.abc import Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from recordings.atomic_files import writing
from recordings.errors import BadInput
from recordings.hdf5.header import RESERVED
from recordings.hdf5.opening import being_written, check_vacant, journal_path
from recordings.hdf5.reader import read
from recordings.hdf5.recover import Recovery, recover
from recordings.hdf5.writer import write
from recordings.importers.assemble import Imported, assemble, text_columns
from recordings.importers.clock import first_date
from recordings.importers.file_format import format_of, is_recording
from recordings.importers.mapping import ImportMapping, load_mapping, mapping_names, mapping_of, with_changes
from recordings.importers.table import ForeignTable

__all__ = [
    "ForeignTable",
    "ImportMapping",
    "Imported",
    "import_file",
    "import_to",
    "is_recording",
    "load_mapping",
    "mapping_names",
    "mapping_of",
    "read_table",
    "recover_to",
    "with_changes",
]


def import_file(path: str | Path, mapping: ImportMapping | None = None) -> Imported:
    """Make a recording of a CSV, TSV, MATLAB, HDF5 or Parquet file.

    Parameters
    ----------
    path : str or Path
        The file; its kind is recognised by its content.
    mapping : ImportMapping, optional
        What its columns are; without one, columns whose header says a known name and a unit are taken.

    Raises
    ------
    BadInput
        The file cannot be read, or the mapping does not fit it; names file, row or column, and what to do.
    """
    path, mapping = Path(path), mapping or ImportMapping()
    table = _table(path, mapping)
    attributes: dict[str, str | float] = {k: v for k, v in table.constants.items() if k not in RESERVED}
    attributes |= mapping.attributes
    with path.open("rb") as file:
        attributes |= {"imported_from": path.name, "imported_sha256": hashlib.file_digest(file, "sha256").hexdigest()}
    written = datetime.fromtimestamp(int(path.stat().st_mtime), UTC)
    about = {"title": mapping.title or path.name, "source": mapping.source, "attributes": attributes}
    return assemble(table, mapping, created=first_date(table, mapping.time) or written, **about)


def _table(path: Path, mapping: ImportMapping) -> ForeignTable:
    if is_recording(path):
        raise BadInput(str(path), "it is a recording already", "use it as it is")
    return format_of(path).read(path, mapping.file, text_columns(mapping))


def recover_to(path: str | Path, target: str | Path, *, overwrite: bool = False) -> Recovery:
    """Copy a recording, put right from its journal if it was cut off while recording; the original is left alone.

    Raises
    ------
    BadInput
        The recording is still being written, or is damaged and has no journal, or the target is there.
    """
    path, target = Path(path), Path(target)
    journal = journal_path(path)
    if not journal.exists():
        recording = read(path)
        write(target, recording, overwrite=overwrite)
        return Recovery(target, len(recording), merged=False)
    if path.exists() and being_written(path):
        raise BadInput(str(path), "it is still being recorded", "stop the recorder first")
    check_vacant(target, overwrite, parameter="overwrite")
    try:
        with writing(target):
            if path.exists():
                shutil.copyfile(path, target)
            shutil.copyfile(journal, journal_path(target))
        return recover(target)
    except BaseException:  # an interruption, too, leaves nothing that could be taken for a recording
        target.unlink(missing_ok=True)
        journal_path(target).unlink(missing_ok=True)
        raise


def import_to(
    path: Path,
    target: Path,
    name: str | None = None,
    changes: Mapping[str, Any] | None = None,
    *,
    overwrite: bool = False,
) -> tuple[str, ...]:
    """Import a file into a recording, or recover a recording that was cut off.

    Parameters
    ----------
    path, target : Path
        The foreign file and the recording to make.
    name : str, optional
        A ready mapping or a TOML file.
    changes : mapping, optional
        What to say differently from it, section by section; values that are None or empty say nothing.
    overwrite : bool
        Whether the target may be replaced.

    Returns
    -------
    tuple of str
        Sentences on what was left out, repaired or lost.
    """
    if target.exists() and path.exists() and target.samefile(path):
        raise BadInput(str(target), "it is the file to import", "choose another name for the recording")
    check_vacant(target, overwrite, parameter="overwrite")
    if is_recording(path):
        return recover_to(path, target, overwrite=overwrite).lost
    mapping = load_mapping(name) if name else ImportMapping()
    imported = import_file(path, with_changes(mapping, changes or {}, "options"))
    write(target, imported.recording, overwrite=overwrite)
    return imported.notes


def read_table(path: str | Path, mapping: ImportMapping | None = None) -> ForeignTable:
    """The columns of a foreign file as they stand there, for programs that choose among them. Raises BadInput."""
    return _table(Path(path), mapping or ImportMapping())
