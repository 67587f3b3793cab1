"""The models of a next test: one whose parameters are weak, or those that tracing could not separate."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from recordings import BadInput
from simulator import CATALOGUE, Catalogue, Value, ValveModel

NO_TRACE = "give a model.json of a fit, or a trace.json of 'bristle trace'"


def models_of(path: Path, catalogue: Catalogue = CATALOGUE) -> dict[str, ValveModel]:
    """The models of a `model.json`, which is one, or of a `trace.json`, by name.

    Raises BadInput for a file that is neither.
    """
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise BadInput(str(path), f"it cannot be read ({error})", NO_TRACE) from None
    if not isinstance(content, dict) or content.get("format") != "valve-trace":
        return {path.stem: ValveModel.read(path, catalogue)}
    try:
        return models_of_trace(content, catalogue)
    except (LookupError, TypeError, ValueError, AttributeError) as error:
        raise BadInput(str(path), f"it is no trace that has its models ({error!r})", NO_TRACE) from None


def models_of_trace(content: Mapping[str, Any], catalogue: Catalogue = CATALOGUE) -> dict[str, ValveModel]:
    """The models of a trace by name: the verdict and what cannot be told from it, or the base model.

    content : as in `trace.json`.
    """
    verdict, base = str(content["verdict"]), content["base"]
    if verdict in ("none", "unlisted"):
        return {"base": _model(content, tuple(base["effects"]), {}, catalogue)}
    rows = {str(row["effect"]): row for row in content["candidates"]}
    return {
        effect: _model(content, (*base["effects"], effect), dict(rows[effect]["refit"] or {}), catalogue)
        for effect in (verdict, *content["same_class"])
    }


def _model(
    content: Mapping[str, Any], effects: tuple[str, ...], refit: Mapping[str, float], catalogue: Catalogue
) -> ValveModel:
    """The base model with an effect, at the values that its refit found; what is known of the base stays known."""
    base, values = content["base"], {}
    for name, parameter in catalogue.parameters(effects).items():
        known = base["parameters"].get(name)
        value = refit.get(name, None if known is None else known["value"])
        if value is None:
            raise LookupError(f"no value for {name}")
        held = parameter.known != ""
        values[name] = Value(
            value=value, unit=parameter.unit, std=None if known is None else known["std"],
            status="given" if held else "weak" if known is None else known["status"],
        )  # fmt: skip
    return ValveModel(
        effects=effects, parameters=values, plant=dict(base.get("plant", {})), noise=dict(base.get("noise", {}))
    )
