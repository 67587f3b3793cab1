"""The residual: its distribution against the noise, its autocorrelation against that of white noise."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from identification.report.canvas import ALARM, BAND, INK, RESIDUAL, canvas, finish_legend, inked, shade
from identification.report.runs import RecordingRun, runs
from identification.report.section import Section
from identification.report.wording.fit_quality import AT_FLOOR, fit_quality, over_noise
from identification.report.wording.numbers import number, percent
from identification.result import FitResult
from recordings import Array

LAGS = 120
"""Lags shown, at most a quarter of the shortest recording."""
BINS = 81
MANY = 0.05
"""Share of lags outside the band above which the residual is called structured; white noise has 0.01."""


def residual(identification: FitResult) -> Section:
    """The residual section: fitted recordings only, each in multiples of its own noise."""
    fitted = [r for r in runs(identification) if r.role == "fitted" and r.known > 3]
    if not fitted:
        return Section("residual", "Residual", {"known": False})
    errors = [r.error / (r.trajectory.noise or 1.0) for r in fitted]
    correlation, band = autocorrelation(errors)
    outside = float(np.mean(np.abs(correlation) > band)) if len(correlation) else 0.0
    words = {
        "known": True, "ratio": number(over_noise(fitted)), "lags": len(correlation),
        "outside": round(outside * len(correlation)), "expected": number(0.01 * len(correlation), 2),
        "share": percent(outside), "structured": outside > MANY,
        "large": over_noise(fitted) > AT_FLOOR, "windowed": fit_quality(identification).window is not None,
    }  # fmt: skip
    lag_unit = _lag_unit(fitted)
    plots = {
        "histogram": _histogram(np.concatenate(errors)),
        "autocorrelation": _correlogram(correlation, band, *lag_unit),
    }
    return Section("residual", "Residual", words, plots)


def autocorrelation(errors: Sequence[Array]) -> tuple[Array, float]:
    """Autocorrelation at lags 1, 2, ... over several residuals (n_samples,) with unknown samples left out, and the
    half width of the band that holds 99 % of the values of white noise (Box and Jenkins).
    """
    lags = min(LAGS, min(len(e) for e in errors) // 4)
    products, counts = np.zeros(lags + 1), np.zeros(lags + 1)
    for error in errors:
        seen = np.isfinite(error)
        centred = np.where(seen, error - np.mean(error[seen]), 0.0)
        products += _lagged_products(centred, lags)
        counts += _lagged_products(seen.astype(float), lags)
    mean = products / np.maximum(counts, 1.0)
    correlation = mean[1:] / mean[0] if mean[0] > 0 else np.zeros(lags)
    return correlation, float(BAND / np.sqrt(max(counts[0], 1.0)))


def _lagged_products(signal: Array, lags: int) -> Array:
    """Sum of signal(k) signal(k + lag) for lag 0 ... lags, by Fourier transform."""
    size = int(2 ** np.ceil(np.log2(len(signal) + lags + 1)))
    spectrum = np.fft.rfft(signal, size)
    return np.fft.irfft(np.abs(spectrum) ** 2, size)[: lags + 1]


def _lag_unit(fitted: Sequence[RecordingRun]) -> tuple[float, str]:
    """Milliseconds per lag where all recordings have one spacing; else lags are counted in samples."""
    spacings = [float(np.nanmedian(np.diff(r.trajectory.t))) for r in fitted]
    same = max(spacings) - min(spacings) <= 0.01 * max(spacings)
    return (1e3 * spacings[0], "lag [ms]") if same else (1.0, "lag [samples]")


def _histogram(errors: Array) -> Any:
    errors = errors[np.isfinite(errors)]
    spread = max(float(np.std(errors)), 1e-12)
    edge = max(4.5, 4.5 * spread)
    density, edges = np.histogram(np.clip(errors, -edge, edge), bins=BINS, range=(-edge, edge), density=True)
    z = np.linspace(-edge, edge, 801)
    normal = np.exp(-0.5 * z**2) / np.sqrt(2 * np.pi)
    top = 1.2 * max(float(density.max()), min(0.4, 1.5 * float(density.max())))
    plot = canvas("residual [multiples of the noise level]", "density [1]", 300, y_range=(0, top))
    plot.quad(
        left=edges[:-1],
        right=edges[1:],
        bottom=0,
        top=density,
        color=RESIDUAL,
        line_color=None,
        fill_alpha=0.7,
        legend_label="residual",
    )
    inked(plot.line(z, normal, color=INK, line_width=1.5, legend_label="the noise alone"))
    finish_legend(plot)
    return plot


def _correlogram(correlation: Array, band: float, step: float, label: str) -> Any:
    lag = step * np.arange(1, len(correlation) + 1)
    reach = max(1.3 * float(np.abs(correlation).max(initial=0.0)), 3 * band)
    plot = canvas(label, "autocorrelation [1]", 300, y_range=(-min(reach, 1.05), min(reach, 1.05)))
    shade(plot, band)
    outside = np.abs(correlation) > band
    for some, colour, name in ((~outside, RESIDUAL, "inside the 99 % band"), (outside, ALARM, "outside")):
        if some.any():
            plot.segment(lag[some], 0.0, lag[some], correlation[some], color=colour, line_width=2, legend_label=name)
    finish_legend(plot)
    return plot
