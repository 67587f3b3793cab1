"""What an examination came to, as a section of ``docs/examinations.md`` that is sealed and never edited."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from statistics import median

from benchmarks.examination.subjects import HEALTHY_S, TRUTH, Row

PAGE = Path("docs/examinations.md")
SEAL = re.compile(r"^% sealed ([0-9a-f]{64})$", re.MULTILINE)


def section(title: str, lines: Sequence[str]) -> str:
    """A section with its seal: the SHA-256 of its text."""
    text = "\n".join([f"## {title}", "", *lines]).strip() + "\n"
    return f"{text}\n% sealed {hashlib.sha256(text.encode()).hexdigest()}\n"


def broken(page: str) -> list[str]:
    """Titles of the sections of a page that are not as they were written, or that have no seal."""
    found = []
    for part in re.split(r"(?m)^(?=## )", page)[1:]:
        seal = SEAL.search(part)
        text = part[: seal.start()].strip() + "\n" if seal else ""
        if seal is None or hashlib.sha256(text.encode()).hexdigest() != seal[1]:
            found.append(part.splitlines()[0][3:])
    return found


def append(text: str, page: Path = PAGE) -> None:
    """Add a section at the end; one of the same title is refused with a ValueError."""
    before = page.read_text(encoding="utf-8")
    if text.splitlines()[0] in before.splitlines():
        raise ValueError(f"{page} has the section {text.splitlines()[0]!r} already; an examination is written once")
    page.write_text(before.rstrip() + "\n\n" + text, encoding="utf-8")


def scores(rows: Sequence[Row]) -> Iterator[str]:
    """Lines of Markdown: a table for each subject, then every miss."""
    by = {
        name: [row for row in rows if row["subject"] == name] for name in ("fit", "trace", "monitor", "assess", "emps")
    }
    yield "| subject | cases | score |"
    yield "| --- | --- | --- |"
    for name, words in (("fit", _fit), ("trace", _named), ("monitor", _monitor), ("assess", _named), ("emps", _emps)):
        if by[name]:
            yield f"| {name} | {len(by[name])} | {words([row for row in by[name] if 'failed' not in row])} |"
    fits = [row for row in by["fit"] if "failed" not in row]
    if fits:
        yield from _parameters(fits)
    missed = [line for row in rows if (line := miss(row))]
    yield from ("", "Missed:" if missed else "Missed: nothing.", "")
    yield from (f"- {line}" for line in missed)


def _parameters(fits: Sequence[Row]) -> Iterator[str]:
    """A table of the parameters; errors are of values with an interval, for the others are not meant to be used."""
    yield from ("", "| parameter | intervals stated | that hold | median error [%] | largest [%] |", "| --- " * 5 + "|")
    for name in TRUTH:
        stated = [row for row in fits if name in row["holds"]]
        size = [100 * abs(row["errors"][name]) for row in stated]
        errors = f"{median(size):.2g} | {max(size):.2g}" if size else "- | -"
        yield f"| `{name}` | {len(stated)} of {len(fits)} | {sum(row['holds'][name] for row in stated)} | {errors} |"


def miss(row: Row) -> str | None:
    """What went wrong in a case, in words; None where nothing did."""
    name = f"{row['subject']} {row['case']}" + (f" ({row['asked']})" if "asked" in row else "")
    if "failed" in row:
        return f"{name}: {row['failed']}"
    if row["subject"] == "fit":
        outside = [
            f"`{key}` off by {100 * row['errors'][key]:+.1f} %" for key, held in row["holds"].items() if not held
        ]
        words = ([] if row["converged"] else ["did not converge"]) + (
            [f"outside its interval: {', '.join(outside)}"] if outside else []
        )
        return f"{name}: {'; '.join(words)}" if words else None
    if row["subject"] == "monitor":
        words = [f"{row['false_alarms']} false alarms"] if row["false_alarms"] else []
        words += ["not seen"] if row["delay_s"] is None else []
        words += ["an alarm stood when the fault came"] if row["standing"] else []
        return f"{name}: {', '.join(words)}" if words else None
    if row["subject"] == "emps" or row["score"] == "right":
        return None
    return f"{name}: {row['score']}, `{row['answered']}`" + ("" if row.get("complete", True) else ", out of time")


def _fit(rows: Sequence[Row]) -> str:
    holds = [held for row in rows for held in row["holds"].values()]
    return (
        f"{sum(row['converged'] for row in rows)} converged; {sum(holds)} of {len(holds)} 95 % intervals hold the truth"
    )


def _named(rows: Sequence[Row]) -> str:
    words = [row["score"] for row in rows]
    return ", ".join(f"{words.count(word)} {word}" for word in dict.fromkeys(["right", "wrong", *words]))


def _monitor(rows: Sequence[Row]) -> str:
    delays = [row["delay_s"] for row in rows if row["delay_s"] is not None]
    late = f"median delay {median(delays):.0f} s" if delays else "no delay"
    false, hours = sum(row["false_alarms"] for row in rows), len(rows) * HEALTHY_S / 3600.0
    promised = sum(row["promised"] for row in rows)
    return f"{false} false alarms in {hours:g} h, {promised:.2g} promised; {len(delays)} faults seen, {late}"


def _emps(rows: Sequence[Row]) -> str:
    return "; ".join(
        f"{100 * row['official']:.2f} % on the official validation file "
        f"({100 * row['fitted']:.2f} % on the fitted one), "
        f"`{row['answered']}`; published 5.98 and 5.36 %"
        for row in rows
    )
