"""A valve model as a CasADi function: one step, with derivatives, for optimisation and control."""

from __future__ import annotations

from pathlib import Path

import casadi as ca

from recordings import BadInput, appearing
from simulator.export.step_parts import ExportedStep
from simulator.relaxation import Expression

ROUNDS = 40
"""Rounds of the search for the velocity at mid-step. A graph cannot stop early; after the fifth little happens."""
INFINITE = 1e6
"""An end of the bracket that is not known yet [m/s]; infinity itself would spoil derivatives."""
REACH = 1e-2
"""How far beyond w an unknown end is sought, relative to w and to 1 m/s."""


def casadi_step(step: ExportedStep, *, sub_steps: int = 1) -> ca.Function:
    """The step of a model as a CasADi function, differentiable like any other.

    Inputs by name: ``state`` as in the header of the C source; ``force`` and ``force_end`` [N] at start and end of the
    step, between which it runs linearly; ``dt`` [s]; ``time`` [s] at the start; ``change`` of the parameters from those
    of the model, in SI units, nothing where not given; with a dead time also ``late`` and ``late_end``, the force a
    dead time earlier less the one now [N]. Outputs: ``state_end``, and ``position`` [m], what is measured at the end.

    sub_steps : into how many equal parts the step is divided. Raises ValueError where there is none.
    """
    if sub_steps < 1:
        raise ValueError(f"a step has {sub_steps} sub-steps; give 1 or more")
    one = _sub_step(step)
    names = ["state", "force", "force_end", "dt", "time", "change", *(("late", "late_end") if step.delay else ())]
    lengths = {"state": len(step.states), "change": len(step.parameters)}
    given = {name: ca.MX.sym(name, lengths.get(name, 1)) for name in names}
    ways = ca.DM([[j + 0.5, j + 1.0] for j in range(sub_steps)]).T / sub_steps
    h = given["dt"] / sub_steps

    def between(name: str, way: Expression) -> Expression:
        return given[name] + way * (given[f"{name}_end"] - given[name])

    columns = [given["time"] + ways[0, :] * given["dt"], ca.repmat(h, 1, sub_steps)]
    for row in range(2 if step.recurrence.ends else 1):
        columns.append(between("force", ways[row, :]))
        columns += [between("late", ways[row, :]), ca.MX(1, sub_steps)] if step.delay else []
    p = ca.DM([parameter.value for parameter in step.parameters]) + given["change"]
    end = one.fold(sub_steps)(given["state"], ca.vertcat(*columns), ca.repmat(p, 1, sub_steps))
    at_end = [given["time"] + given["dt"], 0.0, *_inputs(step, given["force_end"], given.get("late_end", 0.0))]
    position = step.functions["output"](end, ca.vertcat(*at_end), p)
    return ca.Function("step", list(given.values()), [end, position], names, ["state_end", "position"])


def write_casadi(step: ExportedStep, path: Path, *, sub_steps: int = 1) -> Path:
    """Write the function in CasADi's own format; ``casadi.Function.load`` reads it. Raises BadInput when it cannot."""
    made = casadi_step(step, sub_steps=sub_steps)
    try:
        with appearing(path) as temporary:
            made.save(str(temporary))
    except RuntimeError as error:
        raise BadInput(str(path), f"it cannot be written ({error})", "check the path") from error
    return path


def _sub_step(step: ExportedStep) -> ca.Function:
    """A sub-step as a function of state, exo and parameters."""
    functions = step.functions
    search = _search(step)
    s, e, p = (ca.MX.sym(name, size) for name, size in zip("sep", step.recurrence.sizes[:3], strict=True))
    guess = functions["guess"](s, e, p)
    found = search.fold(ROUNDS)(ca.vertcat(guess, -INFINITE, INFINITE), ca.repmat(ca.vertcat(s, e, p), 1, ROUNDS))
    return ca.Function("sub_step", [s, e, p], [functions["step"](found[0], s, e, p)])


def _search(step: ExportedStep) -> ca.Function:
    """A round of the search of the C source: Newton inside a bracket. Its state is w, the lower and the upper end.

    Where it has arrived it stays, and its derivative is that of the implicit function.
    """
    sizes = step.recurrence.sizes
    state, given = ca.SX.sym("state", 3), ca.SX.sym("given", sum(sizes[:3]))
    s, e, p = ca.vertsplit(given, [0, sizes[0], sizes[0] + sizes[1], sum(sizes[:3])])
    w, low, high = ca.vertsplit(state)
    value, slope = step.functions["residual"](w, s, e, p)
    low, high = ca.if_else(value > 0, low, ca.fmax(low, w)), ca.if_else(value > 0, ca.fmin(high, w), high)
    newton = w - value / slope
    reach = REACH * (1 + ca.fabs(w))
    away = ca.if_else(low <= -INFINITE, w - reach, ca.if_else(high >= INFINITE, w + reach, (low + high) / 2))
    small = ca.fabs(newton - w) <= 1e-10 * (ca.fabs(w) + step.recurrence.scale)
    fine = ca.logic_and(slope > 0, ca.logic_or(small, ca.logic_and(newton > low, newton < high)))
    return ca.Function("search", [state, given], [ca.vertcat(ca.if_else(fine, newton, away), low, high)])


def _inputs(step: ExportedStep, force: Expression, late: Expression) -> list[Expression]:
    """The inputs of the recurrence at a sample, and where it asks for them those at the end of a sub-step."""
    inputs = [force, late, 0.0] if step.delay else [force]
    return inputs * 2 if step.recurrence.ends else inputs
