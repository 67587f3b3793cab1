"""Valves, experiments and recordings of a seed. Ranges and shapes are the examination's own."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from benchmarks.examination.plant import CONTROL_S, KEPT_S, Valve, run
from recordings import Array, Recording

Rng = np.random.Generator
TICK_S = 1e-4
"""The clock of the recorder shows whole ticks; a sample is taken between them."""


def valve(rng: Rng) -> Valve:
    """A valve of 12 to 60 mm stroke; fc 1 to 6 % of the spring's span, pre-sliding 5 to 40 um."""
    stroke, K = rng.uniform(0.012, 0.06), 10 ** rng.uniform(4.3, 5.1)
    span = K * stroke
    fc = rng.uniform(0.01, 0.06) * span
    fs, m = fc * rng.uniform(1.05, 1.6), rng.uniform(0.8, 6.0)
    sigma0 = fc / rng.uniform(5e-6, 4e-5)
    area, filling, sigma2 = span / rng.uniform(6e4, 1.6e5), rng.uniform(0.03, 0.15), rng.uniform(0.5, 6.0) * fc
    return Valve(
        m=m, K=K, F0=rng.uniform(0.1, 0.6) * span, fc=fc, fs=fs, vs=rng.uniform(1e-3, 1e-2), sigma0=sigma0,
        sigma1=2.0 * rng.uniform(0.2, 1.0) * np.sqrt(sigma0 * m), sigma2=sigma2, area=area, stroke=stroke,
        filling=filling, gain=min(rng.uniform(1.0, 3.0), 0.5 * critical_gain(m, K, sigma2, filling)) * K / area,
        integral=rng.uniform(0.5, 2.0) * K / area,
    )  # fmt: skip


def critical_gain(m: float, K: float, sigma2: float, filling: float) -> float:
    """The gain, in springs, at which a positioner swings the stem without friction (Routh): it is tuned below that."""
    return sigma2 / (filling * K) + sigma2**2 / (m * K) + filling * sigma2 / m


def setpoint(stroke: float, seconds: float, shape: str, rng: Rng) -> Array:
    """Set point [m]: ``steps`` of random height and length, a slow ``sweep`` with ripple, or ``service``."""
    n = round(seconds / CONTROL_S)
    t = CONTROL_S * np.arange(n)
    if shape == "sweep":
        periods = rng.integers(2, 4)
        part = (
            0.5
            - 0.36 * np.cos(2 * np.pi * periods * t / seconds)
            + 0.04 * np.sin(2 * np.pi * rng.uniform(0.2, 0.5) * t)
        )
    else:
        longest = 8.0 if shape == "steps" else 20.0
        lengths = rng.uniform(1.5, longest, int(seconds / 1.5) + 2)
        heights = rng.uniform(0.12, 0.88, len(lengths))
        part = heights[np.searchsorted(np.cumsum(lengths), t)]
    return stroke * part


def measured(known: Valve, raw: Array, rate: float, rng: Rng) -> Recording:
    """What a recorder leaves: intervals that jitter by a tenth, times in ticks, 14 bits of position, 13 of pressure."""
    n = int((len(raw) - 2) * KEPT_S * rate)
    t = (np.arange(1, n) + rng.uniform(-0.1, 0.1, n - 1)) / rate
    grid = KEPT_S * np.arange(len(raw))
    position, pressure = (np.interp(t, grid, raw[:, i]) for i in (0, 1))
    shown = TICK_S * np.round(t / TICK_S)
    steps = (known.stroke / 2**14, 2.0 * known.K * known.stroke / known.area / 2**13)
    position, pressure = (
        step * np.round((z + rng.normal(0.0, step, len(t))) / step)
        for z, step in zip((position, pressure), steps, strict=True)
    )
    plant = {"stroke_m": known.stroke, "diaphragm_area_m2": known.area}
    return Recording.from_arrays(time=shown, position=position, pressure=pressure, plant=plant, source="simulated")


def experiments(known: Valve, rate: float, rng: Rng, seconds: float = 60.0) -> tuple[list[Recording], Recording]:
    """Steps and a sweep to fit, other steps that are held out."""
    shapes = ("steps", "sweep", "steps")
    made = [measured(known, run(known, setpoint(known.stroke, seconds, s, rng), rng), rate, rng) for s in shapes]
    return made[:2], made[2]


Law = Callable[[Valve, Rng], Valve]
EFFECTS: dict[str, Law] = {
    "none": lambda v, r: v,
    "position_dependent_friction": lambda v, r: v._replace(
        spot=r.uniform(0.3, 1.5), spot_x=r.uniform(0.35, 0.65) * v.stroke, spot_w=r.uniform(0.08, 0.2) * v.stroke),
    "hardening_spring": lambda v, r: v._replace(k3=r.uniform(0.2, 1.0) * v.K / (0.25 * v.stroke**2)),
    "quadratic_drag": lambda v, r: v._replace(drag=r.uniform(0.5, 2.0) * v.fc / (2.0 * v.stroke) ** 1.8),
    "backlash": lambda v, r: v._replace(play=r.uniform(0.005, 0.02) * v.stroke),
    "sensor_lag": lambda v, r: v._replace(sensor_lag=r.uniform(0.02, 0.08)),
    "dead_time": lambda v, r: v._replace(dead=r.uniform(0.02, 0.08)),
    "fading spring": lambda v, r: v._replace(fade=r.uniform(0.5, 2.0) * 1e-3),
    "random force": lambda v, r: v._replace(gust=r.uniform(0.1, 0.5) * v.fc, gust_s=r.uniform(0.2, 1.0)),
}  # fmt: skip
"""By the name that `trace` should give; the last two are in no catalogue: there `unlisted` is right."""
UNLISTED = ("fading spring", "random force")
TRACED = (
    "none", "position_dependent_friction", "fading spring", "hardening_spring", "none", "quadratic_drag",
    "random force", "backlash", "none", "sensor_lag", "fading spring", "dead_time",
)  # fmt: skip
"""What the cases of `trace` lack, one after the other and again from the start: a quarter nothing, a quarter something
that is in no catalogue."""
