"""The fit to whole recordings in damped order: steps along new paths, and descents where the model lacks much."""

from __future__ import annotations

import functools
from dataclasses import replace

import numpy as np

from benchmarks.plant_sampling import recordings
from identification.data.grid import grids
from identification.estimators.coordinates import Coordinates
from identification.estimators.noise_aware.damped import DampedNoiseAware, damped_for
from identification.estimators.noise_aware.damped_search import on_whole_recordings
from simulator import BASE, kernel


@functools.cache
def valve():
    """The estimator of a stem test at 50 Hz, and the true parameters."""
    truth, experiments = recordings(11303, 50.0)
    base = kernel(BASE)
    coordinates = Coordinates.of(base, {}, 700.0)
    theta = coordinates.theta_of(truth)
    return damped_for(base, coordinates, grids(experiments), theta), theta


def test_steps_along_new_paths_lead_back_to_the_valve():
    work, theta = valve()
    start = work.start(theta + 0.02 * np.sign(np.sin(np.arange(len(theta)))))
    end = work.followed(start)
    assert end.settled
    near = [work.names.index(name) for name in ("spring.K", "lugre.fc", "lugre.fs", "lugre.sigma2")]
    assert np.abs(end.theta - theta)[near].max() < 0.005
    assert work.mended(end).loss < 1.05 < start.loss


def test_a_model_that_lacks_much_is_descended(monkeypatch):
    work, theta = valve()
    end = replace(work.start(theta), loss=10.0)
    calls = []
    monkeypatch.setattr(DampedNoiseAware, "followed", lambda self, now, steps=1: calls.append(now) or now)
    found = on_whole_recordings(work, end)
    assert found.explains
    assert not calls


def test_none_where_the_model_diverges(monkeypatch):
    work, theta = valve()
    end = work.start(theta)
    monkeypatch.setattr(DampedNoiseAware, "start", lambda *_: None)
    assert on_whole_recordings(work, end) is None
