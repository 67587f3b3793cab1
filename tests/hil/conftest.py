"""What the tests of the monitor share: a model of the served valve, and a healthy recording of it."""

from __future__ import annotations

from pathlib import Path

import pytest
from monitor_rig import healthy_file, model_file


@pytest.fixture(scope="session")
def folder(tmp_path_factory) -> Path:
    return tmp_path_factory.mktemp("monitor")


@pytest.fixture(scope="session")
def model(folder) -> Path:
    return model_file(folder)


@pytest.fixture(scope="session")
def healthy(folder) -> Path:
    return healthy_file(folder)
