"""The files of an evaluation."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from detector.evaluation.outcome import Evaluation
from detector.evaluation.results.html import page
from detector.evaluation.results.rows import tables
from detector.evaluation.results.table import ResultTable
from recordings import save_text


def write(outcome: Evaluation, out: Path, more: Sequence[ResultTable] = ()) -> list[Path]:
    """One CSV file per table, ``evaluation.md`` and ``evaluation.html``; `more` tables stand before the last.

    Raises BadInput when they cannot be written.
    """
    made = tables(outcome)
    made = [*made[:-1], *more, made[-1]]
    sections = [table.markdown() for table in made if table.name != "trials"]
    text = "\n".join(["# Detectors on the benchmark", "", *sections])
    files = {out / f"{table.name}.csv": table.csv() for table in made}
    files |= {out / "evaluation.md": text, out / "evaluation.html": page(outcome, made)}
    for path, content in files.items():
        save_text(path, content)
    return list(files)
