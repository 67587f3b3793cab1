"""dy/dt = pace h(y) g(x - f(y)) as a loop compiled by numba, of tables of f, g and h at even spacing."""

from __future__ import annotations

from simulator.hysteresis.masing import native

PER_STEP = 0.1
"""Step of RK4 in units of the time constant where it starts."""


@native
def between(at, low, high, values):  # type: ignore[no-untyped-def]
    """A table (n) over [low, high], linear between its points."""
    place = (at - low) / (high - low) * (len(values) - 1)
    i = min(max(int(place), 0), len(values) - 2)
    return values[i] + (values[i + 1] - values[i]) * (place - i)


@native
def slope(at, low, high, values):  # type: ignore[no-untyped-def]
    """The derivative of a table."""
    spacing = (high - low) / (len(values) - 1)
    i = min(max(int((at - low) / spacing), 0), len(values) - 2)
    return (values[i + 1] - values[i]) / spacing


@native
def solve(t, x, paces, y, span, f, h, reach, g, out):  # type: ignore[no-untyped-def]
    """Fill out (n_samples) from y on. paces (n_samples - 1) : w of each interval; span : least and largest y, of the
    tables f and h; reach : of g, on both sides of 0.
    """
    out[0] = y
    for k in range(len(t) - 1):
        pace, whole, done = paces[k], t[k + 1] - t[k], 0.0
        rise = (x[k + 1] - x[k]) / whole
        while pace > 0 and done < whole:
            now = x[k] + rise * done
            fast = stiffness(y, now, span, f, h, reach, g) * pace
            step = min(whole - done, PER_STEP / fast if fast > 0 else whole)
            a = rate(y, now, span, f, h, reach, g) * pace
            b = rate(y + step / 2 * a, now + rise * step / 2, span, f, h, reach, g) * pace
            c = rate(y + step / 2 * b, now + rise * step / 2, span, f, h, reach, g) * pace
            d = rate(y + step * c, now + rise * step, span, f, h, reach, g) * pace
            y += step / 6 * (a + 2 * b + 2 * c + d)
            done = done + step if done + step > done else whole
        out[k + 1] = y


@native
def stiffness(y, x, span, f, h, reach, g):  # type: ignore[no-untyped-def]
    """Bound on d(h g)/dy [1/s] at a point."""
    apart = x - between(y, span[0], span[1], f)
    by_g = between(y, span[0], span[1], h) * slope(apart, -reach, reach, g) * slope(y, span[0], span[1], f)
    return abs(by_g) + abs(slope(y, span[0], span[1], h) * between(apart, -reach, reach, g))


@native
def rate(y, x, span, f, h, reach, g):  # type: ignore[no-untyped-def]
    """h(y) g(x - f(y))."""
    apart = x - between(y, span[0], span[1], f)
    return between(y, span[0], span[1], h) * between(apart, -reach, reach, g)
