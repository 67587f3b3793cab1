"""The friction-velocity map: friction computed from the data and from the model, with the steady LuGre curve on top."""

from __future__ import annotations

from typing import Any

import numpy as np

from identification.report.canvas import INK, MEASURED, REFERENCE, canvas, finish_legend, inked
from identification.report.decimate import cells
from identification.report.runs import RecordingRun, runs
from identification.report.section import Section
from identification.report.wording.numbers import number
from identification.result import FitResult
from recordings import Array

Cloud = tuple[Array, Array]
"""Velocities [m/s] and friction forces [N], each (n_known,)."""

SLOW = 6.0
"""The second map shows speeds up to this many Stribeck velocities."""
SHOWN = 1.6
"""The force axes end at this many times the largest force in the data: a badly known fs may lie far beyond."""
BLURRED = 0.03
"""Motion this near to missing samples [s] is smoothed from made-up ones and is left out."""
NEEDED = ("lugre.fc", "lugre.fs", "lugre.vs", "lugre.sigma2")


def friction(identification: FitResult) -> Section:
    """The section of the friction map."""
    values = identification.model.values
    if any(name not in values for name in NEEDED):
        return Section("friction", "Friction against velocity", {"lugre": False})
    fitted = [r for r in runs(identification) if r.role == "fitted"]
    data = _joined([measured_friction(r, values) for r in fitted])
    model = _joined([modelled_friction(r, values) for r in fitted])
    fastest, slow = float(np.abs(data[0]).max(initial=0.0)), SLOW * values["lugre.vs"]
    plots = {"all": _drawn(data, model, fastest or 1.0, values)}
    if 0 < slow < 0.7 * fastest:
        plots["slow"] = _drawn(_near(data, slow), _near(model, slow), slow, values)
    added = [e for e in identification.model.effects if e not in ("inertia", "spring", "lugre")]
    words = {"lugre": True, "slow": number(1e3 * slow) if "slow" in plots else None, "added": added}
    return Section("friction", "Friction against velocity", words, plots)


def measured_friction(run: RecordingRun, values: dict[str, float]) -> Cloud:
    """Friction u - m a - K x - F0 from the smoothed measured motion and the measured force, where both are known."""
    tr = run.trajectory
    return _balance(run, tr.position, tr.velocity, run.actuator_force, values)


def modelled_friction(run: RecordingRun, values: dict[str, float]) -> Cloud:
    """The same of the model's run: its own motion where the force drives, its own force where the motion is imposed."""
    tr = run.trajectory
    if tr.unit == "N":
        return _balance(run, tr.position, tr.velocity, tr.simulated, values)
    return _balance(run, tr.simulated, _rate(tr.simulated, tr.t), tr.force, values)


def steady_curve(v: Array, values: dict[str, float]) -> Array:
    """Friction at steady velocity v [m/s] (n,) in N: g(v) sgn v + sigma2 v (Canudas de Wit et al. 1995, eq. 5)."""
    fc, fs, vs, sigma2 = (values[name] for name in NEEDED)
    level = fc + (fs - fc) * np.exp(-((v / vs) ** 2)) if vs > 0 else np.full_like(v, fc)
    return level * np.sign(v) + sigma2 * v


def _balance(run: RecordingRun, x: Array, v: Array, u: Array, values: dict[str, float]) -> Cloud:
    mass, K, F0 = (values.get(name, 0.0) for name in ("mass.m", "spring.K", "spring.F0"))
    t = run.trajectory.t
    force = u - mass * _rate(v, t) - K * x - F0
    reach = int(BLURRED / float(np.nanmedian(np.diff(t)))) + 1
    missing = np.convolve(np.isnan(run.trajectory.measured), np.ones(2 * reach + 1), "same")[: len(t)] > 0.5
    known = np.isfinite(force) & np.isfinite(v) & ~missing
    return v[known], force[known]


def _rate(signal: Array, t: Array) -> Array:
    with np.errstate(all="ignore"):  # the clock has no value between stretches
        return np.gradient(signal, t)


def _joined(clouds: list[Cloud]) -> Cloud:
    return np.concatenate([c[0] for c in clouds]), np.concatenate([c[1] for c in clouds])


def _near(cloud: Cloud, slow: float) -> Cloud:
    near = np.abs(cloud[0]) <= slow
    return cloud[0][near], cloud[1][near]


def _drawn(data: Cloud, model: Cloud, fastest: float, values: dict[str, float]) -> Any:
    largest = float(np.abs(data[1]).max(initial=0.0))
    limits = {"y_range": (-SHOWN * largest, SHOWN * largest)} if largest > 0 else {}
    plot = canvas("velocity [mm/s]", "friction force [N]", 400, **limits)
    _scatter(plot, data, MEASURED, 5, "measured")
    inked(_scatter(plot, model, INK, 2, "simulated"))
    slow = min(SLOW * values["lugre.vs"], fastest)
    side = np.unique(
        np.concatenate([[1e-6 * fastest], np.linspace(0, fastest, 200)[1:], np.linspace(0, slow, 120)[1:]])
    )
    curve, gap = steady_curve(side, values), [np.nan]
    plot.line(1e3 * np.concatenate([-side[::-1], gap, side]), np.concatenate([-curve[::-1], gap, curve]),
              color=REFERENCE, line_width=2.5, legend_label="fitted, steady")  # fmt: skip
    finish_legend(plot)
    return plot


def _scatter(plot: Any, cloud: Cloud, colour: str, size: int, label: str) -> Any:
    """A cloud thinned to one point per cell of a raster, the darker the more points it stands for."""
    kept, count = cells(*cloud, 240, 160)
    alpha = np.clip(0.4 + 0.15 * np.log2(np.maximum(count, 1)), 0.4, 1.0).astype(np.float32)
    v, force = ((factor * z[kept]).astype(np.float32) for factor, z in zip((1e3, 1.0), cloud, strict=True))
    return plot.scatter(v, force, size=size, color=colour, line_color=None, alpha=alpha, legend_label=label)
