"""From physical signals to what the benchmark records: shares of each transmitter's span, with noise, within 0 to 1."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from recordings import Array, Integers
from simulator.damadics.noise import CHANNELS, Noise

SPANS: Mapping[str, float] = MappingProxyType(
    {"CV": 1.0, "P1": 4e6, "P2": 4e6, "T1": 200.0, "X": 1.0, "F": 40.0, "CVI": 1.0, "Ps": 1e6, "Pz": 1e6}
)
"""Span of each transmitter: Pa, degC, t/h and shares. CVI (-1 to 1) is sent as (1 + CVI)/2. For Ps and Pz the block
diagram divides by 1 MPa, the text says 0.6 MPa."""

_SPANS = np.array([SPANS[name] for name in CHANNELS])


def measured(signals: Array, noise: Noise | None = None, steps: Integers | None = None) -> Array:
    """What the transmitters send, shape (n, 9), columns `CHANNELS`, shares of the spans within 0 to 1.

    signals (n, n_signals): as `Actuator.advance` returns them; noise: added unless None; steps (n,): step numbers of
    the rows, needed with noise. CV is sent as the actuator got it, so its noise is that of its way in.
    """
    shares = signals[:, : len(CHANNELS)] / _SPANS
    shares[:, CHANNELS.index("CVI")] = (1 + signals[:, CHANNELS.index("CVI")]) / 2
    if noise is not None and steps is not None:
        shares += noise.measured(steps)
    return np.clip(shares, 0.0, 1.0)
