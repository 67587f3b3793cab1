"""Pictures of backlash and hysteresis."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from typing import Any

import numpy as np

from simulator.backlash import AdaptiveBacklashInverse, Backlash, BacklashInverse, SmoothBacklash
from simulator.friction import LuGreParameters
from simulator.hysteresis import (
    AdaptiveQuadrilateralInverse,
    ChuaStromsmoe,
    LeuvenStack,
    MovingPreisach,
    NonlinearPreisach,
    Preisach,
    Quadrilateral,
    QuadrilateralInverse,
    first_order_curves,
    second_order_curves,
)
from tools.gallery.drawing import picture


def route(points: list[float], n: int = 120) -> np.ndarray:
    """A path through turning points in small one-way moves."""
    return np.concatenate([np.linspace(a, b, n)[1:] for a, b in itertools.pairwise(points)])


def even(a: float, b: float) -> float:
    """F of an even weight."""
    return (a - b) ** 2 / 2


@picture("Presliding loops of the Leuven stack: closed at every size", "leuven")
def leuven(axes: Any) -> None:
    x = 1e-6 * route([0, 100, -60, 70, -30, 40, 0, 40, -30, 70, -60, 100, -100])
    axes.plot(1e6 * x, LeuvenStack(lambda z: 2e6 * z, 100.0).follow(x))
    axes.set(xlabel="position [µm]", ylabel="hysteresis force [N]")


def pushed(follow: Callable[[np.ndarray], np.ndarray], low: float, high: float, cycles: int) -> np.ndarray:
    """The path of a body that a force drives slowly to and fro: on until its friction is the force."""
    path = np.zeros(1)
    for way in (1, -1) * cycles:
        ahead = path[-1] + way * np.linspace(0, 3e-4, 1500)[1:]
        force = follow(np.concatenate([path, ahead]))[len(path) :]
        path = np.concatenate([path, ahead[: np.argmax(way * force >= (high if way > 0 else -low)) + 1]])
    return path


@picture("A force to and fro between 20 and 60 N: the bristle of LuGre creeps", "leuven")
def creep(axes: Any) -> None:
    bristle = LuGreParameters(2e6, 0.0, 0.0, 100.0, 100.0, 1e-3)

    def stack(x: np.ndarray) -> np.ndarray:
        return LeuvenStack(lambda z: 2e6 * z, 100.0).follow(x)

    for follow, label in ((lambda x: bristle.follow(np.arange(len(x)), x), "LuGre"), (stack, "Leuven")):
        x = pushed(follow, 20.0, 60.0, 5)
        axes.plot(1e6 * x, follow(x), label=label)
    axes.set(xlabel="position [µm]", ylabel="force [N]")
    axes.legend(frameon=False)


@picture("Backlash, its inverse, and backlash-like hysteresis (2.36)-(2.43)", "backlash")
def backlash(axes: Any) -> None:
    v = 1.5 * np.sin(np.linspace(0, 4 * np.pi, 800))
    gap, smooth = Backlash(1.0, -0.5, 0.5), SmoothBacklash(1.8, 1.0, 0.1)
    inverse = BacklashInverse(1.0, -0.5, 0.5)
    axes.plot(v, [gap.update(x) for x in v], label="backlash")
    axes.plot(v, [smooth.update(x) for x in v], label="backlash-like")
    axes.plot(v, [inverse.update(x) for x in v], color="0.7", lw=0.8, label="inverse")
    axes.set(xlabel="input v", ylabel="output u")
    axes.legend(frameon=False)


@picture("An inverse that learns its backlash", "backlash")
def adaptive(axes: Any) -> None:
    gap, inverse = Backlash(1.4, -0.4, 0.3), AdaptiveBacklashInverse(1.0, -0.05, 0.05, gain=0.2)
    k = np.arange(1500)
    wanted = 1.6 * np.sin(0.05 * k) + 0.6 * np.sin(0.0721 * k)
    errors = []
    for value in wanted:
        got = gap.update(inverse.update(float(value)))
        inverse.learn(got)
        errors.append(got - value)
    axes.plot(k, errors)
    axes.set(xlabel="sample", ylabel="output error")


@picture("Tao and Kokotovic's hysteresis (2.44)", "loops")
def quadrilateral(axes: Any) -> None:
    v = route([0, 4, -4, 2, 0.4, 1.2, -0.5, 3, -2, 0, -1.2, 4])
    loop = Quadrilateral(mt=0.2, ct=1.0, mb=0.3, cb=-1.2, mr=2.0, cr=1.0, ml=1.6, cl=-1.1)
    axes.plot(v, [loop.update(float(x)) for x in v])
    axes.set(xlabel="input v", ylabel="output u")


@picture("Its inverse (2.45), known and learned", "loops")
def inverse_quadrilateral(axes: Any) -> None:
    lines = {"mt": 0.2, "ct": 1.0, "mb": 0.3, "cb": -1.2, "mr": 2.0, "cr": 1.0, "ml": 1.6, "cl": -1.1}
    first = {name: value * (1.25 if i % 2 else 0.8) for i, (name, value) in enumerate(lines.items())}
    k = np.arange(12_000)
    wanted = 2.4 * np.sin(0.05 * k) + 0.9 * np.sin(0.0721 * k)
    known, learning = QuadrilateralInverse(**lines), AdaptiveQuadrilateralInverse(**first)
    one, other = Quadrilateral(**lines), Quadrilateral(**lines)
    errors = []
    for value in wanted:
        learned = other.update(learning.update(float(value)))
        learning.learn(learned)
        errors.append((one.update(known.update(float(value))) - value, learned - value))
    for error, label in zip(
        np.abs(np.array(errors)).reshape(-1, 200, 2).max(axis=1).T, ("known", "learned"), strict=True
    ):
        axes.semilogy(k[::200], error + 1e-16, label=label)
    axes.set(xlabel="sample", ylabel="largest output error of 200 samples")
    axes.legend(frameon=False)


@picture("Chua and Stromsmoe: a loop that widens with frequency (2.46)", "loops")
def chua_stromsmoe(axes: Any) -> None:
    t = np.linspace(0, 2 * np.pi, 400)
    model = ChuaStromsmoe(lambda y: y + 0.5 * y**3, np.sinh, lambda y: 2 + np.tanh(y))
    for pace in (0.1, 1.0, 4.0):
        axes.plot(2 * np.cos(t), model.periodic(t / pace, 2 * np.cos(t)), label=f"{pace:g} rad/s")
    rest = ChuaStromsmoe(lambda y: y + 0.5 * y**3, np.sinh, lambda y: 2 + np.tanh(y), rate=np.abs)
    axes.plot(2 * np.cos(t), rest.periodic(t, 2 * np.cos(t)), "k:", label="(2.51), w = |dx/dt|, any")
    axes.set(xlabel="x", ylabel="y")
    axes.legend(frameon=False)


@picture("What w(dx/dt) makes of the frequency (2.51)", "loops")
def improved(axes: Any) -> None:
    t = np.linspace(0, 2 * np.pi, 400)
    x, paces = 2 * np.cos(t), np.geomspace(0.02, 50, 12)
    forms: dict[str, Callable[[np.ndarray], np.ndarray] | None] = {
        "none: (2.46)": None, "abs": np.abs, "abs, up to 2": lambda v: np.minimum(abs(v), 2.0),
        "square": lambda v: 0.3 * v**2,
    }  # fmt: skip
    for label, rate in forms.items():
        model = ChuaStromsmoe(lambda y: y + 0.5 * y**3, np.sinh, lambda y: 2 + np.tanh(y), rate=rate)
        loops = [model.periodic(t / pace, x) for pace in paces]
        axes.semilogx(paces, [abs(np.trapezoid(y, x)) for y in loops], label=f"w {label}")
    axes.set(xlabel="frequency [rad/s]", ylabel="area of the loop")
    axes.legend(frameon=False)


@picture("f and h from a measured cosine loop (2.48)-(2.50)", "loops")
def construction(axes: Any) -> None:
    t = np.linspace(0, 4, 801)
    y = np.cos(np.pi / 2 * t)
    x = y + 0.2 * y**3 - 0.3 * np.sin(np.pi / 2 * t) * (1 + 0.4 * y)
    model = ChuaStromsmoe.of_cosine_loop(t, x, y)
    at = np.linspace(-1, 1, 100)
    axes.plot(x, y, lw=4, color="0.8", label="measured")
    axes.plot(model.restoring(at), at, "--", label="middle: f")
    axes.plot(x, model.periodic(t, x), label="the model, at the same input")
    axes.set(xlabel="x", ylabel="y")
    axes.legend(frameon=False)


@picture("Preisach: first-order reversal curves and minor loops (2.52)-(2.58)", "preisach")
def preisach(axes: Any) -> None:
    for curve in first_order_curves(Preisach(even, 0.0, 1.0).update, np.linspace(0, 1, 9), samples=10):
        axes.plot(curve.input, curve.output, color="0.8", lw=0.8)
    u = route([0, 1, 0.2, 0.7, 0.4, 0.6, 0.4, 0.9, 0.0])
    axes.plot(u, Preisach(even, 0.0, 1.0).follow(u))
    axes.set(xlabel="input u", ylabel="output f")


@picture("Moving and nonlinear Preisach (2.59)-(2.69)", "preisach")
def moving_and_nonlinear(axes: Any) -> None:
    levels, plain = np.linspace(0, 1, 11), Preisach(even, 0.0, 1.0)
    moving = MovingPreisach.learned(
        first_order_curves(plain.update, levels), below=lambda u: -0.5 + 0.3 * u, above=lambda u: 0.5 + 0.3 * (u - 1)
    )
    nonlinear = NonlinearPreisach.learned(levels, *second_order_curves(lambda u: plain.update(u) * (1 + u), levels))
    u = route([-0.4, 1.4, 0.2, 0.7, 0.3, 1.4, -0.4], 60)
    axes.plot(u, [moving.update(float(x)) for x in u], label="moving")
    inside = np.clip(u, 0, 1)
    axes.plot(inside, [nonlinear.update(float(x)) for x in inside], label="nonlinear")
    axes.set(xlabel="input u", ylabel="output f")
    axes.legend(frameon=False)


@picture("Loops between the same inputs, after two histories", "preisach")
def chords(axes: Any) -> None:
    levels, plain = np.linspace(0, 1, 21), Preisach(even, 0.0, 1.0)
    rig = second_order_curves(lambda u: plain.update(u) * (1 + u), levels)
    models = {
        "classical: congruent": Preisach(even, 0.0, 1.0),
        "nonlinear: equal chords": NonlinearPreisach.learned(levels, *rig),
    }
    for (label, model), colour in zip(models.items(), ("C0", "C1"), strict=True):
        for history, style in (([0.0, 0.9], "-"), ([0.0, 1.0, 0.05, 0.75], "--")):
            for value in (*history, 0.3):
                model.update(value)
            u = route([0.3, 0.7, 0.3], 60)
            axes.plot(
                u, [model.update(float(x)) for x in u], style, color=colour, label=label if style == "-" else None
            )
    axes.set(xlabel="input u", ylabel="output f")
    axes.legend(frameon=False)
