"""The play operator: the finite-state element behind backlash, Maxwell-slip elements and Prandtl-Ishlinskii stacks.

All effects share this one, of CasADi expressions. The operators of `simulator.backlash` and `simulator.hysteresis` work
on plain numbers, with other shapes of the two curves, and are not compiled.
"""

from __future__ import annotations

import casadi as ca

from simulator.relaxation import Expression


def play(held: Expression, drive: Expression, width: Expression) -> Expression:
    """What is held after the drive moved: at most half the width away from it (2.36 with m = 1, cr = -cl = width / 2).

    It depends on where the drive is, not on how many steps led there while it moved one way. Touching is not moving,
    so the derivative by a width of zero is the one towards a positive width.

    >>> [float(play(0.0, x, 1.0)) for x in (0.3, 2.0, -2.0)]
    [0.0, 1.5, -1.5]
    """
    up, down = drive - width / 2 - held, drive + width / 2 - held
    return held + ca.if_else(up > 0, up, 0) + ca.if_else(down < 0, down, 0)
