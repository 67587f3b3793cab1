"""Hysteresis whose memory fits no fixed number of states, as operators with `update(value) -> output`.

After the source document, sections 2.1 and 2.3. They serve studies and tests; what a kernel simulates and
fits are the effects `actuator_hysteresis` and `nonlocal_presliding`, in which a few play and Maxwell-slip elements take
their place.
"""

from simulator.hysteresis.leuven import LeuvenStack, transition_curve
from simulator.hysteresis.maxwell_slip import MaxwellSlip
from simulator.hysteresis.preisach import Preisach
from simulator.hysteresis.quadrilateral import Quadrilateral, QuadrilateralInverse

__all__ = ["LeuvenStack", "MaxwellSlip", "Preisach", "Quadrilateral", "QuadrilateralInverse", "transition_curve"]
