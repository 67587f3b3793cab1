"""The observer (4.12)-(4.20) written a second time, in the letters of the source, by Runge and Kutta's method."""

from __future__ import annotations

import numpy as np


def sigmoid(x, m, slope, c, lam):
    return m / (1.0 + np.exp(-slope * (x - c))) + lam


def networks(x2):
    """S1 and S2 of Section 4.4."""
    sa, sb = (sigmoid(v, 1.41, -10.0225, 0.5974, -2.11) for v in (x2, abs(x2)))
    s = sigmoid(abs(x2), 0.8, -4.0, 2.119, -1.5)
    return np.array([sa, sb, sa**2, sa * sb, sb**2]), np.array([s, s**2, s**3, s**4, s**5])


def rates(s, x1, x2, u, observer):
    """Right-hand sides; s: x1hat, x2hat, w1 (5), w2 (5), e1, b1, alpha1, alpha4, alpha5."""
    s1, s2 = networks(x2)
    x1hat, x2hat, w1, w2, (e1, b1, a1, a4, a5) = s[0], s[1], s[2:7], s[7:12], s[12:]
    xi1, xi2 = x1 - x1hat, x2 - x2hat
    big_phi = abs(x2) * w1 @ s1 + w2 @ s2 + abs(x2) * e1 + b1
    sign = np.tanh(xi2 / observer.delta) if observer.sigm == "tanh" else np.clip(xi2 / observer.delta, -1.0, 1.0)
    phi = -big_phi * sign
    g, h = observer.weight_gain * abs(xi2), observer.alpha_gain * xi2
    return np.concatenate([
        [x2 + observer.k1 * xi1 - a5 * xi2, -a1 * x2hat - a5 * x1hat + a4 * u + observer.k2 * xi2 - phi],
        g * abs(x2) * s1, g * s2, [g * abs(x2), g, -x2hat * h, u * h, -h * (xi1 + x1hat)],
    ])  # fmt: skip


def run(observer, t, x1, x2, u, sub):
    """xi2 at every sample, signals linear in between, `sub` steps from sample to sample."""
    start = observer.start
    s = np.concatenate([[x1[0], x2[0]], np.zeros(10), [start.e1, start.b1, start.alpha1, start.alpha4, start.alpha5]])
    out = [0.0]
    for i in range(len(t) - 1):
        h = (t[i + 1] - t[i]) / sub
        for j in range(sub):
            a, m, b = ([r[i] + (r[i + 1] - r[i]) * (j + part) / sub for r in (x1, x2, u)] for part in (0.0, 0.5, 1.0))
            p = rates(s, *a, observer)
            q = rates(s + 0.5 * h * p, *m, observer)
            r = rates(s + 0.5 * h * q, *m, observer)
            s = s + h / 6.0 * (p + 2.0 * q + 2.0 * r + rates(s + h * r, *b, observer))
        out.append(x2[i + 1] - s[1])
    return np.array(out), s
