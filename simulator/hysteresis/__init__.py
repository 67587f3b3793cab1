"""Hysteresis whose memory fits no fixed number of states, as operators with `update(value) -> output`.

After the source document, sections 2.1 and 2.3. They serve studies and tests; what a kernel simulates and
fits are the effects `actuator_hysteresis` and `nonlocal_presliding`, in which a few play and Maxwell-slip elements take
their place.
"""

from simulator.hysteresis.adaptive_quadrilateral import AdaptiveQuadrilateralInverse
from simulator.hysteresis.chua_stromsmoe import ChuaStromsmoe
from simulator.hysteresis.everett import Everett
from simulator.hysteresis.leuven import LeuvenStack, transition_curve
from simulator.hysteresis.maxwell_slip import MaxwellSlip
from simulator.hysteresis.moving_preisach import MovingPreisach
from simulator.hysteresis.nonlinear_preisach import NonlinearPreisach, second_order_curves
from simulator.hysteresis.preisach import Preisach
from simulator.hysteresis.quadrilateral import Quadrilateral, QuadrilateralInverse
from simulator.hysteresis.quadrilateral_fit import QuadrilateralFit, fit_quadrilateral
from simulator.hysteresis.reversal_curves import ReversalCurve, first_order_curves

__all__ = [
    "AdaptiveQuadrilateralInverse",
    "ChuaStromsmoe",
    "Everett",
    "LeuvenStack",
    "MaxwellSlip",
    "MovingPreisach",
    "NonlinearPreisach",
    "Preisach",
    "Quadrilateral",
    "QuadrilateralFit",
    "QuadrilateralInverse",
    "ReversalCurve",
    "first_order_curves",
    "fit_quadrilateral",
    "second_order_curves",
    "transition_curve",
]
