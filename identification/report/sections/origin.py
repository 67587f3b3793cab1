"""Where the numbers come from: files, given constants, noise, versions."""

from __future__ import annotations

import platform
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, version

from identification.report.section import Section
from identification.report.wording.numbers import count, number, plain
from identification.result import FitResult

PACKAGES = ("bristle", "numpy", "scipy", "casadi", "pysindy", "bokeh")
UNITS = {"_kg": "kg", "_m2": "m²", "_N_per_m": "N/m", "_N": "N", "_m": "m"}
"""Ending of the name of a plant's constant -> its unit; longer endings first where one ends another."""


def origin(identification: FitResult) -> Section:
    """The section of provenance."""
    model = identification.model
    words = {
        "files": [{"file": f.file, "sha256": f.sha256, "samples": count(f.samples)} for f in model.fitted_to],
        "held_out": [t.name for t in identification.holdout],
        "effects": ", ".join(model.effects),
        "causality": model.quality.get("causality"),
        "given": [(n, plain(p.value), p.unit) for n, p in model.parameters.items() if p.status == "given"],
        "plant": [_constant(name, value) for name, value in model.plant.items()],
        "noise": _noise(model.noise),
        "versions": [(name, _version(name)) for name in PACKAGES] + [("Python", platform.python_version())],
        "written": datetime.now(UTC).strftime("%Y-%m-%d %H:%M UTC"),
    }
    return Section("origin", "Where the numbers come from", words)


def _constant(name: str, value: float | str) -> tuple[str, str, str]:
    for ending, unit in UNITS.items():
        if name.endswith(ending) and not isinstance(value, str):
            return name.removesuffix(ending).replace("_", " "), plain(float(value)), unit
    return name.replace("_", " "), value if isinstance(value, str) else plain(float(value)), ""


def _noise(noise: dict[str, float | None]) -> list[tuple[str, str, str]]:
    drawn = {"position_m": ("position", 1e6, "µm"), "force_N": ("force", 1.0, "N")}
    return [
        (drawn[k][0], number(drawn[k][1] * v), drawn[k][2]) for k, v in noise.items() if k in drawn and v is not None
    ]


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return "source tree"
