"""The published models of EMPS have the published errors when they are scored as their authors do it."""

from __future__ import annotations

import pytest

from benchmarks.emps_scoring import (
    ASYMMETRIC,
    END,
    FITTED,
    OFFICIAL,
    PUBLISHED,
    SYMMETRIC,
    PublishedModel,
    measured,
    published_error,
)
from benchmarks.measured_data import DATA

pytestmark = [
    pytest.mark.skipif(not (DATA / f"emps/{name}.mat").is_file(), reason=f"emps/{name}.mat is not in {DATA}")
    for name in (FITTED, OFFICIAL)
]


@pytest.mark.parametrize(("file", "model"), [pytest.param(*one, id=f"{one[0]}, {one[1].mass} kg") for one in PUBLISHED])
def test_the_published_errors_are_reproduced(file: str, model: PublishedModel) -> None:
    """To every digit of per cents that is published."""
    assert published_error(model, measured(file)) == pytest.approx(PUBLISHED[file, model], abs=5e-7)


def test_what_the_asymmetric_model_has_on_the_official_file() -> None:
    """Not published: it follows from the published values."""
    assert published_error(ASYMMETRIC, measured(OFFICIAL)) == pytest.approx(0.05365, abs=1e-5)


def test_the_last_samples_are_scored() -> None:
    """Without them the published models have 0.01 to 0.05 % less."""
    for file, model in [*PUBLISHED, (OFFICIAL, ASYMMETRIC)]:
        recording = measured(file)
        assert 1e-4 < published_error(model, recording) - published_error(model, recording, END) < 6e-4


def test_other_models_have_larger_errors() -> None:
    recording = measured(OFFICIAL)
    without = PublishedModel(SYMMETRIC.mass, SYMMETRIC.viscous, SYMMETRIC.coulomb)
    assert published_error(without, recording) > published_error(SYMMETRIC, recording) + 0.001
