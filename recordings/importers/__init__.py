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

import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from recordings.atomic_files import writing
from recordings.errors import BadInput
from recordings.exchange import parts_of_table
from recordings.hdf5.opening import being_written, check_vacant, journal_path
from recordings.hdf5.reader import read
from recordings.hdf5.recover import Recovery, recover
from recordings.hdf5.writer import write
from recordings.importers.assemble import Imported
from recordings.importers.exported import read_exported
from recordings.importers.file_format import is_recording
from recordings.importers.first_look import ImportPreview, PreviewedColumn, as_json, preview, with_decimal_sign
from recordings.importers.mapping import ImportMapping, load_mapping, mapping_names, mapping_of, with_changes
from recordings.importers.reading import import_file, read_table
from recordings.importers.table import ForeignTable
from recordings.recording import Recording

__all__ = [
    "ForeignTable",
    "ImportMapping",
    "ImportPreview",
    "Imported",
    "PreviewedColumn",
    "as_json",
    "import_file",
    "import_to",
    "is_recording",
    "load_mapping",
    "mapping_names",
    "mapping_of",
    "preview",
    "read_table",
    "recover_to",
    "with_changes",
    "with_decimal_sign",
]


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
    whole = None if name or _says(changes or {}) else read_exported(path)
    if whole is not None:
        write(target, Recording(**parts_of_table(whole, str(path))), overwrite=overwrite)
        return ()
    mapping = load_mapping(name) if name else ImportMapping()
    imported = import_file(path, with_changes(mapping, changes or {}, "options"))
    write(target, imported.recording, overwrite=overwrite)
    return imported.notes


def _says(changes: Any) -> bool:
    """Whether changes to a mapping say anything."""
    if isinstance(changes, Mapping):
        return any(_says(value) for value in changes.values())
    return changes is not None and changes != ()
