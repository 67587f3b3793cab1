"""A valve model: effects and their parameter values with what is known of their quality. What `model.json` stores."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from recordings import BadInput, check_depth, read_small_text, save_text
from simulator.effect import Catalogue
from simulator.effects import CATALOGUE

Status = Literal["identified", "weak", "unresolved", "at_bound", "given"]


class Value(BaseModel):
    """One parameter: value, standard deviation and bounds in `unit`; note : with what it is collinear."""

    model_config = ConfigDict(frozen=True, allow_inf_nan=False)
    value: float
    std: float | None = Field(default=None, ge=0.0)
    unit: str
    lower: float | None = None
    upper: float | None = None
    status: Status = "given"
    note: str | None = None

    @model_validator(mode="after")
    def _bounds_in_order(self) -> Value:
        if self.lower is not None and self.upper is not None and self.lower > self.upper:
            raise ValueError(f"the lower bound {self.lower:g} is above the upper one, {self.upper:g}")
        return self


class FittedTo(BaseModel):
    """A recording that a model was fitted to."""

    model_config = ConfigDict(frozen=True, allow_inf_nan=False)
    file: str
    sha256: str
    samples: int


class ValveModel(BaseModel):
    """Effects by id (base first) and all their parameters by full name, with the noise, the errors and the quality.

    noise : ``position_m`` and ``force_N``, standard deviations; error : ``fit`` and ``holdout``, each with ``rmse_m``
    (or ``rmse_N`` where the motion is imposed) and ``nrmse``; quality : condition number, outcome and the like.

    >>> ValveModel(effects=("inertia",), parameters={"mass.m": Value(value=2.0, unit="kg")})
    <ValveModel of inertia: mass.m 2 kg>
    """

    model_config = ConfigDict(frozen=True, allow_inf_nan=False)
    format: Literal["valve-model"] = "valve-model"
    version: Literal[1] = 1
    effects: tuple[str, ...]
    parameters: dict[str, Value]
    plant: dict[str, float | str] = Field(default_factory=dict)
    noise: dict[str, float | None] = Field(default_factory=dict)
    fitted_to: tuple[FittedTo, ...] = ()
    error: dict[str, dict[str, float] | None] = Field(default_factory=dict)
    quality: dict[str, Any] = Field(default_factory=dict)

    def __repr__(self) -> str:
        values = ", ".join(f"{name} {p.value:.4g} {p.unit}".rstrip() for name, p in self.parameters.items())
        return f"<ValveModel of {', '.join(self.effects)}: {values}>"

    @property
    def values(self) -> dict[str, float]:
        """Parameter values by full name, SI units."""
        return {name: p.value for name, p in self.parameters.items()}

    def write(self, path: str | os.PathLike[str]) -> None:
        """Write `model.json`, all or nothing. Raises BadInput when it cannot be written."""
        save_text(Path(path), json.dumps(self.model_dump(mode="json"), indent=1, allow_nan=False) + "\n")

    @classmethod
    def read(cls, path: str | os.PathLike[str], catalogue: Catalogue = CATALOGUE) -> ValveModel:
        """Read `model.json`, with effects of a `catalogue`.

        Raises BadInput naming the file, the item and what is wrong with it.
        """
        remedy = "give a model.json of a fit or a trace"
        text = read_small_text(Path(path), remedy)
        check_depth(Path(path), text, remedy)
        try:
            model = cls.model_validate_json(text)
        except ValidationError as error:
            first = error.errors()[0]
            place = ".".join(str(part) for part in first["loc"]) or "the whole file"
            raise BadInput(f"{path}: {place}", first["msg"], "give a model.json of a fit or a trace") from error
        _check_complete(model, str(path), catalogue)
        return model


def _check_complete(model: ValveModel, where: str, catalogue: Catalogue) -> None:
    """A model's effects exist, their parameters are there and in bounds, its plant is numbers. Or BadInput."""
    for item, known in model.plant.items():
        if isinstance(known, str) and item != "tag":
            raise BadInput(f"{where}: plant.{item}", f"{known!r} is no number", "every item but the tag is a number")
    for effect in model.effects:
        if effect not in catalogue:
            found, remedy = f"there is no effect '{effect}'", f"there are {', '.join(catalogue.ids)}"
            raise BadInput(f"{where}: effects", found, remedy)
        for name, parameter in catalogue.parameters([effect]).items():
            if name not in model.parameters:
                raise BadInput(f"{where}: parameters", f"there is no {name}", f"the effect {effect} needs it")
            value = model.parameters[name].value
            if not parameter.allows(value):
                found = f"the value is {value:g}"
                raise BadInput(f"{where}: parameters.{name}", found, f"it is {parameter.bounds}")
