"""The numbers of the plant in `benchmarks.plants`: the base valve and all that can be added to it."""

from __future__ import annotations

from typing import NamedTuple


class Physics(NamedTuple):
    """All that the plant can do, in SI units; what is not base is off at its default."""

    m: float
    K: float
    F0: float
    fc: float
    fs: float
    vs: float
    s0: float
    s1: float
    s2: float
    # friction level
    asym_all: float = 0.0  # share, by direction
    asym_coulomb: float = 0.0  # share of fc alone
    spot: float = 0.0  # share at the place
    spot_x: float = 0.0
    spot_w: float = 1.0
    spot_hann: float = 0.0  # 1: a raised cosine instead of a bell
    slope: float = 0.0  # share per m
    wave: float = 0.0  # share, sine along the stroke
    wave_l: float = 1.0
    bell_1: float = 0.0  # shares of three bells in a row, at rest
    bell_2: float = 0.0
    bell_3: float = 0.0
    bell_x: float = 0.0
    bell_w: float = 1.0
    bell_u: float = 1.0  # m/s, the speed at which they have fallen to 1/e
    load: float = 0.0  # share per N**load_e
    load_e: float = 1.0
    dwell: float = 0.0
    dwell_t: float = 1.0
    dwell_d: float = 1.0
    dwell_hyperbola: float = 0.0  # 1: t/(t + T) instead of 1 - exp(-t/T)
    late: float = 0.0  # s, pure delay of the velocity in the level
    late_lag: float = 0.0  # s, first-order lag of it
    curve: float = 0.0  # by which the exponent of the Stribeck curve is less than 2
    drift: float = 0.0  # share per s
    drift_end: float = 0.0  # share, reached exponentially
    drift_T: float = 1.0
    jump: float = 0.0  # share, at one instant
    jump_t: float = 0.0
    clamp: float = 0.0  # share while a clamp is closed
    accel: float = 0.0  # share per m/s2
    # forces
    visc: float = 0.0  # N s/m, at rising position only
    drag: float = 0.0
    drag_e: float = 2.0
    cubic: float = 0.0
    cubic_x: float = 0.0
    stop: float = 0.0
    stop_x: float = 0.0
    stop_e: float = 1.0
    flow: float = 0.0
    flow_x: float = 0.0
    flow_w: float = 1.0
    flow_bell: float = 0.0
    hum: float = 0.0
    hum_f: float = 1.0
    hum_phase: float = 0.0
    hum_triangle: float = 0.0
    screw: float = 0.0
    screw_l: float = 1.0
    screw_phase: float = 0.0
    screw_h: float = 0.0  # share of a second harmonic
    offset: float = 0.0  # N/s
    offset_end: float = 0.0
    offset_T: float = 1.0
    snap: float = 0.0  # N, a step along the stroke
    snap_x: float = 0.0
    snap_w: float = 1.0
    creep: float = 0.0  # N/m, of a spring in series with a damper
    creep_t: float = 1.0
    hose_m: float = 0.0
    hose_k: float = 0.0
    hose_c: float = 0.0
    slip_f: float = 0.0  # N, of a stack of Coulomb elements
    slip_d: float = 1.0
    slip_n: int = 0
    slip_ramp: float = 0.0  # 1: strengths that fall from element to element
    # input
    delay: float = 0.0
    gain: float = 0.0
    loop: float = 0.0  # N, half width of a loop of play operators
    loop_r: float = 1.0
    loop_n: int = 0
    dahl: float = 0.0  # N, half width of a loop of Dahl's law
    dahl_r: float = 1.0
    lag: float = 0.0
    lag2: float = 0.0
    quantum: float = 0.0  # N, with quantum_t s of hold
    quantum_t: float = 0.02
    # output
    play: float = 0.0
    play_at: float = 0.0  # where in the gap it starts, -1 to 1
    out_delay: float = 0.0
    out_lag: float = 0.0
    out_lag2: float = 0.0
    arch: float = 0.0  # m
    arch_sine: float = 0.0  # m
    ess: float = 0.0  # m
    stroke: float = 1.0
    zero: float = 0.0  # m/s
    zero_end: float = 0.0
    zero_T: float = 1.0
    top: float = 1e9  # m, end of the sensor
