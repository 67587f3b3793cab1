"""Pictures of the friction models."""

from __future__ import annotations

from typing import Any

import numpy as np

from simulator.friction import (
    AlphaNetwork,
    AsymmetricMap,
    Bells,
    CanudasMap,
    CoulombMap,
    Drive,
    ExponentialDwell,
    LeuvenFriction,
    LuGreParameters,
    RationalDwell,
    RootMap,
    ServoDesign,
    SevenParameters,
    StribeckAlpha,
    StribeckMap,
    TangentialStiffness,
    TanhObserver,
    fit_map,
    functional,
    functional_basis,
    simulate_drive,
    simulate_servo,
    smoothed_friction,
    taylor_value,
)
from tools.gallery.drawing import picture


@picture("Friction maps (2.3)-(2.5)", "friction")
def maps(axes: Any) -> None:
    v = np.linspace(-0.05, 0.05, 2001)
    for model, label in (
        (CoulombMap(60.0), "Coulomb"),
        (AsymmetricMap(70.0, 55.0, 400.0, 300.0), "asymmetric, viscous"),
        (StribeckMap(60.0, 40.0, 0.0, b=200.0, exponent=1.0), "Stribeck, exponent 1"),
        (StribeckMap(60.0, 40.0, 400.0, b=200.0, exponent=2.0), "Stribeck, exponent 2"),
    ):
        axes.plot(1e3 * v, model.force(v), label=label)
    axes.set(xlabel="velocity [mm/s]", ylabel="friction [N]")
    axes.legend(frameon=False)


@picture("A contact until it breaks away (2.1), (2.2), (2.8)", "friction")
def contact(axes: Any) -> None:
    step = 2e-5
    reference = np.interp(np.arange(0, 3, step), [0, 0.5, 1.0, 3.0], [0, 90e-6, 0, 300e-6])
    run = simulate_drive(SevenParameters(60.0, 0.0, 30.0, 5e6, 1e-3), Drive(1.0, 1e6, 2000.0), reference, step)
    spring = TangentialStiffness(breakaway=90.0, deflection=18e-6)
    x = np.array([0.0, spring.deflection])
    axes.plot(1e6 * x, -spring.force(x), lw=4, color="0.8", label="tangential stiffness")
    axes.plot(1e6 * run.x[::50], -run.friction[::50], label="Armstrong's contact, pulled, let go and pulled again")
    axes.set(xlabel="displacement [µm]", ylabel="friction [N]", xlim=(-2, 60), ylim=(-5, 125))
    axes.legend(frameon=False, loc="upper right")


@picture("Static friction against dwell time (2.6), (2.7)", "friction")
def dwell(axes: Any) -> None:
    t = np.geomspace(1e-2, 1e3, 300)
    for m in (0.5, 1.0, 1.5):
        axes.semilogx(t, ExponentialDwell(100.0, 60.0, 0.3, m).force(t), label=f"(2.6), m = {m:g}")
    axes.semilogx(t, RationalDwell(100.0, 60.0, 3.0).force(t), "--", label="(2.7)")
    axes.set(xlabel="dwell time [s]", ylabel="break-away force [N]")
    axes.legend(frameon=False)


@picture("Armstrong's model pulled by a spring (2.8)-(2.10)", "friction")
def stick_slip(axes: Any) -> None:
    t = np.arange(0, 12, 1e-4)
    for rise in (0.0, 2.0):
        friction = SevenParameters(10.0, 0.0, 5.0, 1e6, 1e-3, rise=rise)
        run = simulate_drive(friction, Drive(1.0, 1000.0, 5.0), 8e-3 * t)
        axes.plot(t[::200], run.force[::200], label=f"rise in {rise:g} s")
    axes.set(xlabel="time [s]", ylabel="force of the spring [N]")
    axes.legend(frameon=False)


@picture("Frictional memory: the loop widens with the rate (2.9)", "friction")
def memory(axes: Any) -> None:
    friction = SevenParameters(10.0, 100.0, 5.0, 1e6, 2e-3, memory=0.02)
    for pace in (2.0, 10.0, 25.0):
        t = np.arange(0, 4 * np.pi / pace, 4e-5)
        reference = 6e-3 * t + 5e-3 * (1 - np.cos(pace * t)) / pace
        run = simulate_drive(friction, Drive(1.0, 1e6, 1e4), reference, 4e-5, (0.0, 6e-3))
        last = t > 2 * np.pi / pace
        axes.plot(1e3 * run.v[last][::20], -run.friction[last][::20], label=f"{pace:g} rad/s")
    axes.set(xlabel="velocity [mm/s]", ylabel="friction [N]")
    axes.legend(frameon=False)


@picture("Canudas' two forms (2.11), (2.12)", "friction")
def canudas(axes: Any) -> None:
    v = np.linspace(0.01, 0.2, 100)
    true = CanudasMap(50.0, 15.0, 30.0, b1=30.0, b2=4.0).force(v)
    found = fit_map(RootMap, v, true)
    axes.plot(1e3 * v, true, lw=3, color="0.7", label="(2.11)")
    axes.plot(1e3 * v, found.map.force(v), label="(2.12), least squares")
    axes.plot(1e3 * v, found.equivalent(0.5).force(v), "--", label="(2.12), other parameters")
    axes.set(xlabel="velocity [mm/s]", ylabel="friction [N]")
    axes.legend(frameon=False)


@picture("LuGre: presliding, break-away and sliding (2.13)-(2.17)", "lugre")
def lugre(axes: Any) -> None:
    t = np.arange(0, 2 * np.pi, 1e-3)
    model = LuGreParameters(1e6, 300.0, 400.0, 60.0, 90.0, 1e-3)
    for size in (2e-5, 1e-4, 3e-4):
        x = size * np.sin(2 * t)
        axes.plot(1e6 * x, model.follow(t, x), label=f"{1e6 * size:g} µm")
    axes.set(xlabel="position [µm]", ylabel="friction [N]")
    axes.legend(frameon=False)


@picture("Weights of alpha(x, v) learned on line (2.23)-(2.26)", "lugre")
def network(axes: Any) -> None:
    bells = Bells(np.array([[p, v] for p in (-0.01, 0.0, 0.01) for v in (-0.03, 0.0, 0.03)]), (0.006, 0.02))
    weights = np.array([500.0, 700, 500, 300, 500, 300, 500, 700, 500])
    t = np.arange(0, 20, 2e-3)
    x = 0.012 * np.sin(2 * t) * np.cos(0.31 * t)
    force = AlphaNetwork(bells, weights, 1e5, 100.0, 50.0).follow(t, x)
    net = AlphaNetwork(bells, np.full(9, 500.0), 1e5, 100.0, 50.0)
    at = np.linspace(-0.012, 0.012, 200)
    axes.plot(1e3 * at, bells(at, 0.0) @ weights, lw=3, color="0.7", label="true, at rest")
    for passes in range(9):
        if passes in (0, 1, 8):
            axes.plot(1e3 * at, net.alpha(at, 0.0), label=f"learned in {passes * 20} s")
        net.learn(t, x, force, gain=0.2)
    axes.set(xlabel="position [mm]", ylabel="alpha [1/m]")
    axes.legend(frameon=False)


@picture("Position control with LuGre's observer (2.18), (2.19)", "lugre")
def observer(axes: Any) -> None:
    model = LuGreParameters(1e5, 316.0, 20.0, 60.0, 90.0, 0.01)
    t = np.arange(0, 6, 1e-4)
    for compensation in (False, True):
        run = simulate_servo(
            model, ServoDesign(1.0, 4000.0, 400.0, 0.0, 20.0), 0.01 * np.sin(2 * t), 1e-4, compensation
        )
        axes.plot(t[::50], 1e3 * run.error[::50], label="with friction compensation" if compensation else "without")
    axes.set(xlabel="time [s]", ylabel="position error [mm]")
    axes.legend(frameon=False)


@picture("Friction parameters as observed states", "lugre")
def tanh(axes: Any) -> None:
    t = np.arange(10_000) * 1e-3
    v = 0.05 * np.sin(3 * t) + 0.02 * np.sin(7.3 * t)
    force = np.gradient(v, t) + smoothed_friction(v, 60.0, 90.0, 0.01, 200.0, 3000.0)
    found = TanhObserver(1.0, 0.01, 3000.0).follow(t, force, v)
    for name, values, true in zip(found.names, found.parameters.T, (60.0, 30.0, 200.0), strict=True):
        axes.plot(t[::20], values[::20] / true, label=name)
    axes.set(xlabel="time [s]", ylabel="estimate / true value")
    axes.legend(frameon=False)


@picture("Expansions of alpha (2.28), (2.29)", "lugre")
def alpha(axes: Any) -> None:
    true, v = StribeckAlpha.of(1e5, 60.0, 90.0, 0.01), np.linspace(1e-4, 0.03, 300)
    for order in (2, 10, 40):
        axes.semilogy(
            1e3 * v, np.abs(taylor_value(true, order, v) / true(v) - 1) + 1e-9, label=f"Taylor, order {order}"
        )
    for order in (1, 4):
        found = functional_basis(0.3, true.c2, order, v) @ functional(true, 0.3, order)
        axes.semilogy(1e3 * v, np.abs(found / true(v) - 1) + 1e-9, "--", label=f"functional, order {order}")
    axes.axvline(1e3 * true.converges_below, color="0.7", lw=0.8)
    axes.set(xlabel="velocity [mm/s]", ylabel="relative error", ylim=(1e-8, 1e2))
    axes.legend(frameon=False)


@picture("The Leuven model in time (2.32)-(2.35)", "leuven")
def leuven_in_time(axes: Any) -> None:
    t = np.arange(0, 3, 2e-4)
    x = 2e-4 * np.sin(2 * t) + 3e-5 * np.sin(25 * t)
    friction = LeuvenFriction(lambda z: 2e6 * z, lambda v: 80 + 20 * np.exp(-((v / 1e-3) ** 2)), 1.0, 50.0, 5e3)
    axes.plot(1e6 * x[::5], friction.follow(t, x)[::5])
    axes.set(xlabel="position [µm]", ylabel="friction [N]")
