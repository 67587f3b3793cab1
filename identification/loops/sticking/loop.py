"""The places of many sticking valves, compiled by numba: `StickingValve` of `sticking.models`.

This file is compiled from its text (`simulator.native_module`), so it imports nothing of ours, and nothing imports it.
"""

# mypy: disallow_untyped_decorators=False
from __future__ import annotations

from typing import Any

import numba
import numpy as np

vector, matrix = numba.float64[::1], numba.float64[:, ::1]


@numba.njit(matrix(vector, vector, vector, vector, vector, numba.boolean), error_model="numpy", nogil=True, cache=True)
def places(op: Any, static: Any, sliding: Any, first: Any, moves: Any, rests: bool) -> Any:
    """Places (k, n) for one controller output (n,). static, sliding, first (k,) : frictions and place at the first
    sample, on the scale of OP; moves (k,) : its direction then, or 0; rests : after every sample, else where OP turns.
    """
    found = np.empty((len(static), len(op)))
    for k in range(len(static)):
        place, way, before = first[k], moves[k], op[0] - moves[k]
        for i in range(len(op)):
            now = op[i]
            if rests or (now - before) * way <= 0:
                way = 0.0
            if way == 0.0 and abs(now - place) > static[k]:
                way = 1.0 if now > place else -1.0
            if way != 0.0:
                place = now - way * sliding[k]
            before = now
            found[k, i] = place
    return found
