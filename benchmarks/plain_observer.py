"""The calibrated observer in plain numpy, one sample at a time, as one would write it first; and filterpy's update."""

from __future__ import annotations

import numpy as np
from filterpy.kalman import KalmanFilter

from detector import Calibration


class PlainObserver:
    """The same steps as the compiled one: velocity filter, errors, decision, b1 outside the dead zone."""

    def __init__(self, calibration: Calibration) -> None:
        self.c, n = calibration, calibration.observer.numbers
        self.k1, self.k2, self.delta = n.k1, n.k2, n.delta
        dt = calibration.dt_s
        gains = calibration.velocity.gains
        self.gain = gains[len(gains) // 2] / dt ** np.arange(3.0)
        self.motion, self.last = np.zeros(3), np.zeros(3)
        self.xi, self.b1, self.count = np.zeros(2), calibration.b1, 0

    def step(self, position: float, u: float) -> bool:
        """One sample; whether there is an alarm."""
        c, dt, rate = self.c, self.c.dt_s, self.k2 + self.c.alpha1
        forward = np.array([[1.0, dt, 0.5 * dt * dt], [0.0, 1.0, dt], [0.0, 0.0, 1.0]])
        self.motion = forward @ self.motion
        self.motion = self.motion + self.gain * (position - self.motion[0])
        now = np.array([self.motion[0], self.motion[1], u])
        fade = np.exp(-np.array([self.k1, rate]) * dt)
        mean = (1.0 - fade) / np.array([self.k1, rate])
        slope = (now - self.last) / dt
        free1 = fade[0] * self.xi[0] + mean[0] * (slope[0] - 0.5 * (now[1] + self.last[1]))
        begin = slope[1] + c.alpha1 * self.last[1] + c.alpha5 * (self.last[0] - self.xi[0]) - c.alpha4 * self.last[2]
        end = slope[1] + c.alpha1 * now[1] + c.alpha5 * (now[0] - free1) - c.alpha4 * u
        free2 = fade[1] * self.xi[1] + mean[1] * begin + (end - begin) / rate * (1.0 - mean[1] / dt)
        h = mean[1] * self.b1
        xi2 = free2 * self.delta / (self.delta + h)
        if np.abs(xi2) > self.delta:
            xi2 = free2 - np.sign(free2) * h
        self.xi, self.last = np.array([free1 + mean[0] * c.alpha5 * xi2, xi2]), now
        rho, size = self.b1 / self.k2, np.abs(xi2)
        self.count = min(self.count + 1, 2) if size > rho else 0
        if self.count < 2 and size >= 0.8 * rho:
            self.b1 = min(self.b1 + dt * size, 1.5 * c.b1)
        return self.count >= 2


def filterpy_filter(dt_s: float) -> KalmanFilter:
    """A constant-acceleration filter of filterpy: its predict and update are what others use for the velocity alone."""
    filter = KalmanFilter(dim_x=3, dim_z=1)
    filter.F = np.array([[1.0, dt_s, 0.5 * dt_s**2], [0.0, 1.0, dt_s], [0.0, 0.0, 1.0]])
    filter.H, filter.R, filter.Q = np.array([[1.0, 0.0, 0.0]]), np.array([[1e-6]]), 1e-4 * np.eye(3)
    return filter
