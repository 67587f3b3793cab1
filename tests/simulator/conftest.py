"""What all tests of the simulator share."""

from __future__ import annotations

import shutil

import pytest


@pytest.fixture(params=["compiler", "numba"])
def way(request, monkeypatch):
    """Every test that asks for it runs twice: kernels made by a C compiler, and kernels made by numba."""
    if request.param == "numba":
        monkeypatch.setenv("BRISTLE_NO_COMPILER", "1")
    elif not any(shutil.which(name) for name in ("cc", "gcc", "clang")):
        pytest.skip("there is no C compiler on this machine")
    else:
        monkeypatch.delenv("BRISTLE_NO_COMPILER", raising=False)
    return request.param
