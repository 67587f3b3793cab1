"""What the tests of the command line share."""

from __future__ import annotations

import pytest
from command_line import Console


@pytest.fixture
def console(capsys: pytest.CaptureFixture[str]) -> Console:
    return Console(capsys)
