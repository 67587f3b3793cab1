"""How often the joint posterior of valve and process holds the truth, and how often it is refused.

    python -m studies.loop_joint --seeds 8000 8012

The loops are those of `simulated_loop` with a sticky LuGre stem on a spring, whose friction and inertia are drawn from
the seed. A refusal is counted apart. Development seeds are 7900 to 7999.
"""

from __future__ import annotations

import argparse
from collections import Counter

import numpy as np

from identification.loops import LugreStem, SimulatedLoop, assess_loop, simulated_loop

STROKE = 0.02
TRUTHS = ("fc [N]", "fs [N]", "gain [PV per % of travel]", "time constant [samples]")


def lugre_loop(seed: int) -> tuple[SimulatedLoop, dict[str, float], float]:
    """The loop of a seed with a LuGre stem, the stem's parameters, and the force of the whole range of OP [N]."""
    rng = np.random.default_rng([seed, 33])
    K = float(10 ** rng.uniform(4.3, 5.0))
    full = K * STROKE
    stems = []

    def stem(s: float, _j: float) -> LugreStem:
        excess = float(np.exp(rng.uniform(np.log(0.15), np.log(2.0))))
        fc = s * full / 100 / (2 + excess)
        values = {
            "mass.m": float(rng.uniform(2, 5)), "spring.K": K, "spring.F0": 0.0, "lugre.fc": fc,
            "lugre.fs": fc * (1 + excess), "lugre.vs": float(10 ** rng.uniform(-3, -2)), "lugre.sigma0": 2e6,
            "lugre.sigma1": 1e3, "lugre.sigma2": float(rng.uniform(100, 1000)),
        }  # fmt: skip
        stems.append(LugreStem(values, full))
        return stems[0]

    known = simulated_loop(seed, "stiction", ("flow", "pressure", "temperature")[seed % 3], stem)
    return known, dict(stems[0].values), full


def main() -> None:
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", nargs=2, type=int, default=(8000, 8004))
    held: Counter[str] = Counter()
    for seed in range(*parser.parse_args().seeds):
        known, stem, _ = lugre_loop(seed)
        found = assess_loop(known.loop, valve={"stroke": STROKE, "K": stem["spring.K"]}, joint=True)
        assert found.joint is not None
        if found.joint.refused:
            held["refused"] += 1
            print(f"seed {seed}: {found.verdict}; refused: {found.joint.refused}", flush=True)
            continue
        truth = dict(zip(TRUTHS, (stem["lugre.fc"], stem["lugre.fs"], known.gain, known.tau), strict=True))
        inside = {n: one.lower <= truth[n] <= one.upper for n, one in found.joint.told.items() if n in truth}
        held["answered"] += 1
        held.update(name for name, inside_it in inside.items() if inside_it)
        held.update(f"{name} told" for name in inside)
        words = "; ".join(
            f"{n} {truth[n]:.3g} in {found.joint.told[n].lower:.3g} to {found.joint.told[n].upper:.3g}" for n in inside
        )
        print(f"seed {seed}: {words}; not told: {', '.join(found.joint.untold)}", flush=True)
    print(f"answered {held['answered']}, refused {held['refused']}")
    for name in TRUTHS:
        print(f"{name}: {held[name]} of {held[f'{name} told']} intervals hold the truth")


if __name__ == "__main__":
    main()
