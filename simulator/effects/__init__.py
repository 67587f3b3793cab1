"""The catalogue: every effect the toolkit knows, base effects first. Adding one is one file and one line here.

The order is that of asking: signals pass from the recording to the stem through the input effects, from the stem to
the recording through the output effects.
"""

from __future__ import annotations

from simulator._effect import Catalogue
from simulator.effects.actuator_hysteresis import ActuatorHysteresis
from simulator.effects.actuator_lag import ActuatorLag
from simulator.effects.asymmetric_coulomb import AsymmetricCoulomb
from simulator.effects.asymmetric_viscous import AsymmetricViscous
from simulator.effects.backlash import Backlash
from simulator.effects.contact_stiffness import ContactStiffness
from simulator.effects.dead_time import DeadTime
from simulator.effects.dwell_stiction import DwellStiction
from simulator.effects.flow_force import FlowForce
from simulator.effects.force_gain import ForceGain
from simulator.effects.force_offset_drift import ForceOffsetDrift
from simulator.effects.friction_drift import FrictionDrift
from simulator.effects.frictional_memory import FrictionalMemory
from simulator.effects.hardening_spring import HardeningSpring
from simulator.effects.inertia import Inertia
from simulator.effects.load_dependent_friction import LoadDependentFriction
from simulator.effects.lugre import LuGre
from simulator.effects.nonlocal_presliding import NonlocalPresliding
from simulator.effects.periodic_force import PeriodicForce
from simulator.effects.position_dependent_friction import PositionDependentFriction
from simulator.effects.position_periodic_force import PositionPeriodicForce
from simulator.effects.quadratic_drag import QuadraticDrag
from simulator.effects.sensor_drift import SensorDrift
from simulator.effects.sensor_lag import SensorLag
from simulator.effects.sensor_nonlinearity import SensorNonlinearity
from simulator.effects.spring import Spring

BASE = ("inertia", "spring", "lugre")
"""The effects of the base model."""

CATALOGUE = Catalogue(
    (
        *(Inertia(), Spring(), LuGre()),
        *(AsymmetricCoulomb(), AsymmetricViscous(), PositionDependentFriction(), LoadDependentFriction()),
        *(DwellStiction(), FrictionalMemory(), NonlocalPresliding(), FrictionDrift()),
        *(QuadraticDrag(), HardeningSpring(), ContactStiffness(), FlowForce()),
        *(PeriodicForce(), PositionPeriodicForce(), ForceOffsetDrift()),
        *(DeadTime(), ForceGain(), ActuatorHysteresis(), ActuatorLag()),
        *(Backlash(), SensorLag(), SensorNonlinearity(), SensorDrift()),
    )
)

__all__ = ["BASE", "CATALOGUE"]
