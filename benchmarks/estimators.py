"""How well friction is identified when the recorded force is noisy: the estimators on the same seeded valves.

    python -m benchmarks.estimators --valves 8 --noise 0.001
    python -m benchmarks.estimators --valves 40 --first 20 --noise 0 --rate 100 --only auto

Random valves of `simulator.random_valve`, truth with a sub-step of 0.05 ms; staircase 40 s and sine 50 s at 500 Hz or
another rate; position noise 1e-4 to 4e-4 of the stroke, force noise a share of the force that the spring needs over the
stroke. The bound is the Cramer-Rao bound of the model linearised about the smoothed path at the true parameters.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import replace

import numpy as np

from benchmarks.innovation_form import InnovationForm
from benchmarks.machine import machine
from benchmarks.plant_sampling import GROSS
from identification import Estimator, Experiment, Fit, experiment, fit, uncertainty_of
from identification.estimators import (
    Coordinates,
    Grid,
    Innovations,
    KalmanSmoother,
    NoiseAware,
    PathFreedom,
    Predictor,
    best_on_chunks,
    grids,
    noise_aware_for,
    on_whole_recordings,
    search_for,
    with_smooth_force,
)
from recordings import Array
from simulator import BASE, Excitation, Kernel, Sensors, kernel, random_valve, simulate

NAMES = ("spring.K", "lugre.fc", "fs - fc", "lugre.vs", "lugre.sigma0", "lugre.sigma1", "lugre.sigma2", "mass.m")
ESTIMATORS = ("raw", "smoothed", "innovations", "filter", "noise-aware", "auto")
"""Output error on the recorded force and on the smoothed force; the innovation form and the likelihood of an extended
Kalman filter, with the states and the starts of the noise-aware estimator; that estimator; and what `fit` chooses, for
which one has to ask."""
FITS: dict[str, Estimator] = {
    "raw": "output-error", "smoothed": "output-error", "noise-aware": "noise-aware", "auto": "auto"
}  # fmt: skip
"""Those of them that are fits."""
NORMAL_90 = 1.6449


def valve(seed: int, noise: float, rate: float = 500.0) -> tuple[dict[str, float], list[Experiment]]:
    """A random valve and its two recordings."""
    values, stroke = random_valve(seed)
    position = 10 ** np.random.default_rng([seed, 7]).uniform(-4, np.log10(4e-4)) * stroke
    sensors = Sensors(rate, position_noise=position, force_noise=noise * values["spring.K"] * stroke)
    runs = [
        simulate(values, Excitation.parse(e), sensors, stroke=stroke, seed=10 * seed + i)[0]
        for i, e in enumerate(("staircase:40", "sine:50"))
    ]
    return values, [experiment(r) for r in runs]


def errors(values: dict[str, float], truth: dict[str, float]) -> Array:
    """Relative errors [%] in the order of `NAMES`."""
    pairs = [(with_excess(values)[n], with_excess(truth)[n]) for n in NAMES]
    return np.array([100 * (a / b - 1) for a, b in pairs])


def with_excess(values: dict[str, float]) -> dict[str, float]:
    """The values with the excess of static over Coulomb friction."""
    return values | {"fs - fc": values["lugre.fs"] - values["lugre.fc"]}


def bound(truth: dict[str, float], experiments: list[Experiment]) -> Array:
    """Standard deviations at the bound [%] in the order of `NAMES`."""
    model = kernel(BASE, "force with error")
    c = coordinates(experiments)
    found = NoiseAware(model, c, grids(experiments)).start(c.theta(model.vector(truth)), 4)
    if found is None:
        return np.full(len(NAMES), np.nan)
    covariance = found.covariance * np.outer(c.slope(c.p(found.theta)), c.slope(c.p(found.theta)))
    std = dict(zip(c.names, np.sqrt(np.diag(covariance)), strict=True))
    a, b = c.names.index("lugre.fs"), c.names.index("lugre.fc")
    std["fs - fc"] = np.sqrt(covariance[a, a] + covariance[b, b] - 2 * covariance[a, b])
    return np.array([100 * std[n] / abs(with_excess(truth)[n]) for n in NAMES])


def coordinates(experiments: list[Experiment]) -> Coordinates:
    """All parameters of the base model free, scaled by the force of the experiments."""
    force = float(np.std(np.concatenate([s.u for e in experiments for s in e.segments])))
    return Coordinates.of(kernel(BASE, "force with error"), {}, force)


def fitted(name: str, experiments: list[Experiment]) -> Fit:
    """A fit in one of `FITS`."""
    return fit(with_smooth_force(experiments) if name == "smoothed" else experiments, estimator=FITS[name])


class ExtendedKalman:
    """A `Predictor`, the likelihood of an extended Kalman filter: every interval is linearised about what was seen
    before it. Its path is the fixed point of going to the filter's own means."""

    def line(
        self, kernel: Kernel, coordinates: Coordinates, grid: Grid, p: Array, path: Array, freedom: PathFreedom
    ) -> Innovations | None:
        """The innovations of the filter; None where the model has no solution."""
        return KalmanSmoother().line(kernel, coordinates, grid, p, path, freedom)

    def toward(self, line: Innovations, move: Array | None = None, share: float = 1.0) -> Array:
        """The way to what each sample and those before it say."""
        mean, _, S, E, _, J, K, _, _ = line.smoother
        move = np.zeros(J.shape[2]) if move is None else move
        return np.asarray(share * mean + S @ move + np.einsum("kci,kc->ki", K, share * E - J @ move))


PREDICTORS: dict[str, Predictor] = {"innovations": InnovationForm(), "filter": ExtendedKalman()}


def by_prediction(predictor: Predictor, experiments: list[Experiment]) -> dict[str, float] | None:
    """Parameters by the one-step errors of a predictor; None where it diverges."""
    c, segment_grids = coordinates(experiments), grids(experiments)
    search = search_for(kernel(BASE), c, with_smooth_force(experiments, segment_grids), "damped")
    starts = [] if search is None else search.ends()
    if search is None or not starts:
        return None
    whole = replace(noise_aware_for(kernel(BASE), c, segment_grids, starts, "full"), predictor=predictor)
    best = best_on_chunks(whole, search.all_narrowed(starts), lambda _: False)
    found = None if best is None else on_whole_recordings(whole, best)
    return None if found is None else c.values(found.end.theta)


def usable(found: Fit) -> dict[str, float] | None:
    """The values of a fit that has any."""
    return found.values if found.outcome.usable else None


def off(found: Fit, truth: dict[str, float]) -> dict[str, tuple[str, float]]:
    """Status of each parameter, and its error in standard deviations as reported."""
    known = uncertainty_of(found)
    return {n: (known.status[n], (found.values[n] - truth[n]) / known.spread[n]) for n in known.names}


def main() -> None:
    """Print the table."""
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--valves", type=int, default=8)
    options.add_argument("--first", type=int, default=0, help="seed of the first valve")
    options.add_argument("--noise", type=float, default=1e-3, help="share of the force over the stroke")
    options.add_argument("--rate", type=float, default=500.0, help="samples a second, of both channels")
    options.add_argument("--only", default="", help=f"one estimator: {', '.join(ESTIMATORS)}")
    asked = options.parse_args()
    print(machine("casadi", "numpy", "numba"))
    table: dict[str, list[Array]] = {"bound": []}
    cover: dict[str, list[tuple[str, float]]] = {}
    wrong = list[str]()
    for seed in range(asked.first, asked.first + asked.valves):
        truth, experiments = valve(seed, asked.noise, asked.rate)
        if asked.noise:
            table["bound"].append(bound(truth, experiments))
        for name in [asked.only] if asked.only else ESTIMATORS[:-1]:
            started = time.process_time()
            found = fitted(name, experiments) if name in FITS else None
            values = by_prediction(PREDICTORS[name], experiments) if found is None else usable(found)
            took = time.process_time() - started
            said = "" if found is None else found.outcome.name
            if values is None:
                print(f"  seed {seed} {name}: {said or 'diverged'}")
                continue
            table.setdefault(name, []).append(errors(values, truth))
            words = " ".join(f"{e:+.2f}" for e in table[name][-1])
            rms = "" if found is None else f" rms {found.rms:.3f}"
            print(f"  seed {seed} {name:12} {words}  {said}{rms} {took:.1f} s", flush=True)
            if found is not None and FITS[name] != "output-error":
                for n, (status, z) in off(found, truth).items():
                    cover.setdefault(n, []).append((status, z))
                    if status == "identified" and abs(z) > GROSS:
                        wrong.append(f"{n} of {seed} ({z:+.1f})")
    print(f"median absolute error in %, force noise {100 * asked.noise:g} %\n  {'':12} " + "  ".join(NAMES))
    for name, rows in table.items():
        if rows:
            print(f"  {name:12} " + "  ".join(f"{x:.3g}" for x in np.median(np.abs(rows), axis=0)) + f"  ({len(rows)})")
    coverage(cover)
    print(f"wrong claims, `identified` and more than {GROSS:g} standard deviations off: {', '.join(wrong) or 'none'}")


def coverage(found: dict[str, list[tuple[str, float]]]) -> None:
    """Print how many of the nominal 90 % intervals cover the truth, by parameter."""
    for n, scored in found.items():
        z = np.array([one for status, one in scored if status == "identified"])
        inside, rms = int(np.sum(np.abs(z) <= NORMAL_90)), np.sqrt(np.mean(z**2)) if len(z) else np.nan
        print(f"  {n}: 90 % intervals of {len(z)} `identified` cover {inside}; {len(scored) - len(z)} others; "
              f"error {rms:.2f} standard deviations rms, {np.mean(z) if len(z) else np.nan:+.2f} mean")  # fmt: skip


if __name__ == "__main__":
    main()
