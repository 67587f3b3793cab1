"""The kinds of file that can be shown, and which of them a file is."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

from bristle.cli.shown import recording, results, tables
from bristle.cli.shown.results import FileContent
from recordings import BadInput, read_small_json, read_small_toml
from recordings.importers import is_recording


@dataclass(frozen=True)
class Kind:
    """How a kind of file is shown. words : text for the terminal; facts : the same as JSON; picture : a self-contained
    HTML page, None where the file alone has none, and `instead` says what has one.
    """

    words: Callable[[Path], str]
    facts: Callable[[Path], FileContent]
    picture: Callable[[Path], str] | None = None
    instead: str = ""


KINDS: Mapping[str, Kind] = {
    "recording": Kind(recording.words, recording.facts, recording.picture),
    "register-map": Kind(tables.map_words, tables.toml_facts, tables.map_picture),
    "import-mapping": Kind(tables.mapping_words, tables.toml_facts, instead="it has none"),
    "plant-file": Kind(tables.plant_words, tables.toml_facts, instead="it has none"),
    "valve-model": Kind(results.model_words, results.facts, instead="use 'bristle fit --report' on its recordings"),
    "valve-trace": Kind(results.trace_words, results.facts, instead="use 'bristle trace --report' on its recordings"),
    "valve-comparison": Kind(results.comparison_words, results.facts, instead="use 'bristle compare --report'"),
    "loop-assessment": Kind(results.assessment_words, results.facts, instead="use 'bristle assess --report'"),
    "valve-test": Kind(results.test_words, results.facts, instead="use 'bristle test --report'"),
    "detector-evaluation": Kind(results.evaluation_words, results.facts, instead="its page is evaluation.html"),
    "monitor-state": Kind(results.state_words, results.facts, instead="use 'bristle replay' on recordings"),
    "events": Kind(results.events_words, results.events_facts, instead="it has none"),
}
"""By what `kind_of` says."""


def kind_of(file: Path) -> str:
    """What kind of file it is, ``foreign`` for one of another program. Raises BadInput where there is no such file, and
    for a JSON file that cannot be read.
    """
    suffix = file.suffix.lower()
    if suffix == ".toml":
        return _kind_of_toml(file)
    if suffix == ".jsonl":
        return "events"
    if suffix == ".csv":
        return "register-map" if tables.is_map_table(file) else "foreign"
    if suffix != ".json":
        return "recording" if suffix in {".h5", ".hdf5", ""} or is_recording(file) else "foreign"
    content = read_small_json(file, "give a file that Bristle wrote")
    return str(content.get("format")) if isinstance(content, dict) else "recording"


def _kind_of_toml(file: Path) -> str:
    try:
        content = read_small_toml(file, "")
    except BadInput:  # the reader of register maps has words for it
        return "register-map"
    if "points" in content:
        return "register-map"
    if {"signals", "time", "file"} & set(content):
        return "import-mapping"
    return "plant-file" if {"source", "valve", "valves"} & set(content) else "register-map"
