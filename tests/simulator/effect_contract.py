"""What every effect promises, as a list of checks; each raises AssertionError with words when an effect breaks it."""

from __future__ import annotations

import inspect
import re
from dataclasses import dataclass

import casadi as ca
import numpy as np

from simulator import BASE, Catalogue, Effect, FirstLook, Kernel, Quantities, Site, kernel
from simulator.compile.casadi_to_python import python_source

T = np.arange(1001) / 500.0
KNOTS = np.array(
    [[0, 450], [0.3, 800], [0.6, 800], [0.9, 400], [1.1, 700], [1.4, 500], [1.7, 500], [2.0, 900]], dtype=float
)
FORCE = np.interp(T, *KNOTS.T)
"""A force [N] with fast and slow strokes, reversals inside the stroke, and rests."""

MOTION = np.column_stack([
    0.009 * (1 - np.cos(5 * T)) + 0.0005 * (1 - np.cos(40 * T)),
    0.045 * np.sin(5 * T) + 0.02 * np.sin(40 * T),
    0.225 * np.cos(5 * T) + 0.8 * np.cos(40 * T),
    FORCE,
])  # fmt: skip
"""An imposed motion that starts at rest at x = 0: x [m], v [m/s], a [m/s2], and the force [N] beside it."""

UNIT = re.compile(r"1|(1/)?[a-zA-Z]+\d?( [a-zA-Z]+\d?)*(/[a-zA-Z]+\d?)*")
STEP = 5e-4


@dataclass(frozen=True)
class Subject:
    """An effect on a valve of the base effects, all at their typical values."""

    effect: Effect
    catalogue: Catalogue

    @property
    def names(self) -> tuple[str, ...]:
        """Parameters of the effect."""
        return self.effect.parameter_names()

    @property
    def typical(self) -> dict[str, float]:
        """Every parameter of the valve at its scale."""
        effects = self.catalogue.pick(tuple({*BASE, self.effect.id}))
        return {e.parameter_name(p.symbol): p.scale for e in effects for p in e.parameters}

    @property
    def neutral(self) -> dict[str, float]:
        """The same with the effect switched off."""
        off = {p.symbol: p.neutral for p in self.effect.parameters if p.neutral is not None}
        return self.typical | {self.effect.parameter_name(symbol): value for symbol, value in off.items()}

    @property
    def causalities(self) -> tuple[str, ...]:
        """What can be imposed on it."""
        return ("force", "motion") if self.effect.site is Site.FORCE else ("force",)

    def kernel(self, causality: str) -> Kernel:
        """The valve with the effect."""
        return kernel((*BASE, self.effect.id), causality, self.catalogue)

    def run(self, values, causality="force", h=STEP, **options):
        """Simulate the excitation of this module."""
        return simulate(self.kernel(causality), values, h, **options)

    def jacobian(self, values, causality="force"):
        """Columns of the effect's own parameters (n_samples, n_parameters)."""
        columns = [self.kernel(causality).parameters.index(name) for name in self.names]
        return self.run(values, causality, sensitivities=True).jacobian[:, 0, columns]


def simulate(k, values, h=STEP, **options):
    """Simulate the excitation of this module, from rest."""
    u = FORCE if k.causality == "force" else MOTION
    start = k.start(5e-3 if k.causality == "force" else 0.0, force=FORCE[0])
    scan = k.run(T, u, k.vector(values), start, h_max=h, **options)
    assert scan.failed is None, f"the simulation fails at sample {scan.failed}"
    return scan


def words(s: Subject) -> None:
    """A sentence, something to check on site, and a docstring."""
    for text in (s.effect.sentence, s.effect.check):
        assert text.strip(), "sentence and check must say something"
        assert "\n" not in text, "sentence and check are one line each"
        assert text[0].islower(), "sentence and check are put into others: no capital, no full stop"
        assert not text.endswith("."), "sentence and check are put into others: no capital, no full stop"
    doc = inspect.getdoc(type(s.effect))
    assert doc, "the class needs a docstring"
    assert doc != inspect.getdoc(Effect), "the class needs a docstring of its own"


def parameters(s: Subject) -> None:
    """Unit, meaning, and bounds that contain the typical and the neutral value."""
    assert s.effect.parameters, "an effect has a parameter"
    for p in s.effect.parameters:
        assert UNIT.fullmatch(p.unit), f"{p.symbol}: {p.unit!r} is no unit"
        assert p.meaning.strip(), f"{p.symbol}: the meaning is missing"
        assert np.isfinite(p.scale), f"{p.symbol}: the scale is a number"
        assert p.scale != 0, f"{p.symbol}: the scale is not zero"
        assert p.lower < p.scale < p.upper, f"{p.symbol}: the scale lies inside the bounds"
        assert p.neutral is None or p.lower <= p.neutral <= p.upper, f"{p.symbol}: neutral lies inside the bounds"
        assert not p.positive or p.lower >= 0, f"{p.symbol}: a positive parameter has a lower bound of at least 0"


def memory(s: Subject) -> None:
    """Every memory state has one law or one jump, and says where it starts."""
    e, symbols = s.effect, [m.symbol for m in s.effect.memory]
    q = Quantities(*(ca.SX.sym(name) for name in ("t", "x", "v", "a", "u", "y")))
    p, held = ({name: ca.SX.sym(name) for name in group} for group in ([x.symbol for x in e.parameters], symbols))
    moved = [*e.relax(q, p), *e.jump(q, p, held)]
    assert sorted(moved) == sorted(symbols), f"memory {symbols}, but laws and jumps for {moved}"
    for m in e.memory:
        assert UNIT.fullmatch(m.unit), f"{m.symbol}: {m.unit!r} is no unit"
        assert np.isfinite(m.start), f"{m.symbol}: the start is a number"
        assert not (m.at_position and m.at_force), f"{m.symbol}: starts at the position and at the force"


def hooks(s: Subject) -> None:
    """Only the hooks of its site."""
    by_site = {
        Site.FORCE: {"force", "friction_level", "friction_speed"}, Site.INPUT: {"input"}, Site.OUTPUT: {"output"},
    }  # fmt: skip
    allowed = by_site[s.effect.site]
    own = {name for names in by_site.values() for name in names if name in vars(type(s.effect))}
    assert own, f"an effect has one of the hooks {set().union(*by_site.values())}"
    assert own <= allowed, f"an effect on the {s.effect.site.value} has {allowed}, not {own}"


def neutral(s: Subject) -> None:
    """Base effects have no neutral value; all others have one, where they change nothing at all."""
    values = [p.neutral for p in s.effect.parameters]
    if s.effect.id in BASE:
        assert values == [None] * len(values), "base effects cannot be switched off"
        return
    assert any(value is not None for value in values), "one parameter has a neutral value"
    for causality in s.causalities:
        base = simulate(kernel(BASE, causality), s.typical).outputs
        found = s.run(s.neutral, causality).outputs
        assert abs(found - base).max() <= 1e-9 * np.ptp(base), f"neutral changes the {causality}-driven trajectory"
        changed = s.run(s.typical, causality).outputs
        assert abs(changed - base).max() > 1e-4 * np.ptp(base), f"the effect changes nothing, {causality}-driven"


def derivative(s: Subject) -> None:
    """The jacobian is what differences say, in every causality."""
    for causality in s.causalities:
        exact = s.jacobian(s.typical, causality)
        for i, p in enumerate(s.effect.parameters):
            seen = _differences(s, s.typical, p, causality)
            assert _close(exact[:, i], seen, 2e-4), f"derivative by {p.symbol}, {causality}-driven"


def derivative_at_neutral(s: Subject) -> None:
    """The jacobian is finite at the neutral value and shows the effect: what a score test looks at.

    It is the one towards the allowed side, unless the effect jumps: a play of no width has no uniform derivative.
    A stem at rest yields differently to a push to either side, so a difference to one side agrees less closely.
    """
    for causality in s.causalities:
        exact = s.jacobian(s.neutral, causality)
        for i, p in enumerate(s.effect.parameters):
            if p.neutral is None:
                continue
            assert np.isfinite(exact[:, i]).all(), f"derivative by {p.symbol} at neutral is not finite"
            assert exact[:, i].any(), f"derivative by {p.symbol} at neutral vanishes: no test will ever see the effect"
            if "jump" not in vars(type(s.effect)):
                seen = _differences(s, s.neutral, p, causality)
                assert _close(exact[:, i], seen, 5e-3), f"derivative by {p.symbol} at neutral, {causality}-driven"


def _differences(s, values, p, causality):
    """Second-order difference quotients by one parameter, one for every side on which its bounds have room."""
    name, size = s.effect.parameter_name(p.symbol), 1e-5 * abs(p.scale)

    def at(change):
        return s.run(values | {name: values[name] + change}, causality).outputs[:, 0]

    sides = [h for h in (size, -size) if p.lower <= values[name] + 2 * h <= p.upper]
    return [(-3 * at(0) + 4 * at(h) - at(2 * h)) / (2 * h) for h in sides]


def _close(exact, seen, tolerance):
    """Whether a derivative is between the quotients of its sides, which differ where a stem at rest is pushed anew."""
    beyond = exact - np.clip(exact, np.min(seen, axis=0), np.max(seen, axis=0))
    return np.linalg.norm(beyond) <= tolerance * np.linalg.norm(exact)


def passive(s: Subject) -> None:
    """Where it says so, the effect never gives back more energy than it took up, from rest at x = 0."""
    if not s.effect.passive:
        return
    k = kernel((s.effect.id,), "motion", s.catalogue)
    rng = np.random.default_rng(0)
    for _ in range(20):
        values = {s.effect.parameter_name(p.symbol): p.scale * rng.uniform(0.2, 5) for p in s.effect.parameters}
        x, v, a = _random_motion(rng)
        fine = np.arange(len(x)) * 1e-4
        force = k.run(fine, np.column_stack([x, v, a, 0 * x]), k.vector(values), k.start()).outputs[:, 0]
        work = np.concatenate([[0], np.cumsum((force[1:] + force[:-1]) / 2 * np.diff(x))])
        assert work.min() >= -1e-3 * abs(work).max(), "the effect delivers energy"


def _random_motion(rng):
    """A smooth motion from rest at 0: position, velocity and acceleration (10001) at 0.1 ms."""
    t, w = np.arange(10001) * 1e-4, 2 * np.pi * rng.uniform(0.5, 8, (4, 1))
    size, sine, cosine = 0.01 * rng.uniform(-1, 1, (4, 1)), np.sin(w * t), np.cos(w * t)
    motion = (size * (1 - cosine), size * w * sine, size * w**2 * cosine)
    return tuple(part.sum(axis=0) for part in motion)


def first_guess(s: Subject) -> None:
    """What it reads off recordings are values of its own parameters or of the base, within their bounds, also where a
    valve has no spring; it says so where a model imitates it.
    """
    if s.effect.id in BASE:
        return
    known = {e.parameter_name(p.symbol): p for e in s.catalogue.pick((*BASE, s.effect.id)) for p in e.parameters}
    base = {name: value for name, value in s.typical.items() if name not in s.names}
    y = s.run(s.typical).outputs[:, 0]
    v = np.gradient(y, T)
    for values in (base, base | {"spring.K": 0.0}):
        look = FirstLook.of(T, np.column_stack([y, v, np.where(np.abs(v) > 1e-3, v, 0.0)]), FORCE, values)
        for guess in s.effect.first_guess([look, look], values):
            for name, value in guess.items():
                assert name in known, f"guesses {name}, which is no parameter of it or the base"
                assert known[name].lower <= value <= known[name].upper, f"guesses {name} to be {value:g}"


def portable(s: Subject) -> None:
    """It needs no C compiler: all its operations have a translation."""
    for causality in s.causalities:
        try:
            functions = s.kernel(causality).scanner.recurrence.functions()
            sources = [python_source(function, scalars=("w",)) for function in functions.values()]
        except NotImplementedError as error:
            raise AssertionError(f"without a C compiler: {error}") from error
        assert all(sources)


def recovery(s: Subject) -> None:
    """Clean data gives the effect's parameters back, by Gauss-Newton from 1 % off."""
    for causality in s.causalities:
        truth = np.array([s.typical[name] for name in s.names])
        data = s.run(s.typical, causality).outputs[:, 0]
        found = truth * (1 + 0.01 * (-1.0) ** np.arange(len(truth)))
        for _ in range(8):
            values = s.typical | dict(zip(s.names, found, strict=True))
            scaled = s.jacobian(values, causality) * truth
            residual = data - s.run(values, causality).outputs[:, 0]
            found = found + truth * np.linalg.lstsq(scaled, residual, rcond=None)[0]
        assert abs(found / truth - 1).max() < 1e-6, f"{causality}-driven: {dict(zip(s.names, found, strict=True))}"


CHECKS = (
    words, parameters, memory, hooks, neutral, derivative, derivative_at_neutral, passive, first_guess, portable,
    recovery,
)  # fmt: skip
