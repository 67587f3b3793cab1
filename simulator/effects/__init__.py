"""The catalogue: every effect the toolkit knows, base effects first. Adding one is one file and one line here.

The order is that of asking: signals pass from the recording to the stem through the input effects, from the stem to
the recording through the output effects.
"""

from __future__ import annotations

from simulator.effect import Catalogue
from simulator.effects.force.contact_stiffness import ContactStiffness
from simulator.effects.force.flow_force import FlowForce
from simulator.effects.force.force_offset_drift import ForceOffsetDrift
from simulator.effects.force.hardening_spring import HardeningSpring
from simulator.effects.force.inertia import Inertia
from simulator.effects.force.periodic_force import PeriodicForce
from simulator.effects.force.position_periodic_force import PositionPeriodicForce
from simulator.effects.force.spring import Spring
from simulator.effects.friction.asymmetric_coulomb import AsymmetricCoulomb
from simulator.effects.friction.asymmetric_viscous import AsymmetricViscous
from simulator.effects.friction.dwell_stiction import DwellStiction
from simulator.effects.friction.friction_drift import FrictionDrift
from simulator.effects.friction.frictional_memory import FrictionalMemory
from simulator.effects.friction.load_dependent_friction import LoadDependentFriction
from simulator.effects.friction.lugre import LuGre
from simulator.effects.friction.nonlocal_presliding import NonlocalPresliding
from simulator.effects.friction.position_dependent_friction import PositionDependentFriction
from simulator.effects.friction.quadratic_drag import QuadraticDrag
from simulator.effects.input.actuator_hysteresis import ActuatorHysteresis
from simulator.effects.input.actuator_lag import ActuatorLag
from simulator.effects.input.dead_time import DeadTime
from simulator.effects.input.force_gain import ForceGain
from simulator.effects.output.backlash import PositionBacklash
from simulator.effects.output.sensor_drift import SensorDrift
from simulator.effects.output.sensor_lag import SensorLag
from simulator.effects.output.sensor_nonlinearity import SensorNonlinearity

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
        *(PositionBacklash(), SensorLag(), SensorNonlinearity(), SensorDrift()),
    )
)

__all__ = ["BASE", "CATALOGUE"]
