"""What the evidence weighs, fitted to simulated loops of known cause: `python -m studies.loop_calibration`.

Calibration seeds 1000 to 1399 of `simulated_loop`; the answers are judged on seeds from 5000 on.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

CAUSES_TOLD = ("stiction", "tuning", "disturbance", "backlash", "noise")


@dataclass(frozen=True)
class CalibrationTable:
    """mean, spread (k,) : of the evidence, as in `evidence.NAMES`; weights (causes, 1 + k) : constant first."""

    mean: tuple[float, ...]
    spread: tuple[float, ...]
    weights: tuple[tuple[float, ...], ...]


TABLES: Mapping[str, CalibrationTable] = {
    "integrating": CalibrationTable(
        (
            0,
            0,
            0.5671,
            0,
            0,
            0,
            0.394,
            0.2792,
            0.974,
        ),
        (
            1,
            1,
            0.07027,
            1,
            1,
            1,
            0.6435,
            0.4785,
            0.9507,
        ),
        (
            (
                1.363,
                0,
                0,
                0.1199,
                0,
                0,
                0,
                0.9522,
                0.6065,
                -0.4614,
            ),
            (
                0.5823,
                0,
                0,
                0.2114,
                0,
                0,
                0,
                -0.5627,
                -0.6276,
                0.185,
            ),
            (
                -1.126,
                0,
                0,
                -0.2969,
                0,
                0,
                0,
                -0.1869,
                0.2533,
                1.644,
            ),
            (
                -0.0127,
                0,
                0,
                0.1877,
                0,
                0,
                0,
                0.1919,
                -0.2364,
                -0.6123,
            ),
            (
                -0.8074,
                0,
                0,
                -0.2221,
                0,
                0,
                0,
                -0.3945,
                0.004105,
                -0.7549,
            ),
        ),
    ),
    "self-regulating": CalibrationTable(
        (
            0.1906,
            0.5061,
            0.5983,
            0.1566,
            1.295,
            0.5281,
            1.12,
            0.8928,
            2.037,
        ),
        (
            0.197,
            0.1149,
            0.2039,
            0.2641,
            0.3879,
            0.2564,
            1.319,
            1.11,
            1.12,
        ),
        (
            (
                2.247,
                0.3042,
                0.6277,
                0.8925,
                -0.3271,
                0.9321,
                -0.3365,
                1.046,
                0.9722,
                -0.5018,
            ),
            (
                -0.4277,
                -1.592,
                0.2409,
                0.152,
                -0.2311,
                -0.9123,
                -0.09492,
                -0.1172,
                0.05017,
                0.391,
            ),
            (
                0.08925,
                0.6205,
                0.08775,
                -1.288,
                0.6016,
                -0.2296,
                -0.1344,
                -0.5751,
                -0.2834,
                1.663,
            ),
            (
                -0.8894,
                0.9564,
                -0.139,
                0.2152,
                0.1021,
                0.4986,
                0.02226,
                0.1233,
                -0.4206,
                -0.6764,
            ),
            (
                -1.019,
                -0.2889,
                -0.8174,
                0.02827,
                -0.1455,
                -0.2888,
                0.5436,
                -0.4772,
                -0.3184,
                -0.8755,
            ),
        ),
    ),
}
