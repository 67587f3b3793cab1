"""The classic residual generators of the source's Chapter 3, one file each, with one contract: `step`.

>>> from detector.generators import Limits
>>> limits = Limits(lower=(0.0,), upper=(10.0,))
>>> state, residuals = limits.step(limits.initial(), u=[], y=[5.0])
>>> residuals.tolist()
[0.0]
"""

from detector.generators.contract import EvaluatedGenerator, Generator
from detector.generators.drive.servo import Servo, learn_servo
from detector.generators.drive.waves import Waves, learn_waves
from detector.generators.estimation import Estimation, learn_estimation
from detector.generators.fault_tree import FaultTree, Rule, explain
from detector.generators.flow import Flow, learn_flow
from detector.generators.fuzzy import Fuzzy
from detector.generators.kalman import KalmanResiduals, MatchedFilters, settled
from detector.generators.limits import Limits, learn_limits
from detector.generators.luenberger import Luenberger, full_order, functional, least_order
from detector.generators.neural import NeuralObserver, learn_neural
from detector.generators.parity import Parity, dfd, dfi, static, temporal
from detector.generators.plant import LinearPlant
from detector.generators.spectrum import Spectrum, learn_spectrum
from detector.generators.voting import Voting
from recordings import classes_of

GENERATORS = {kind.__name__: kind for kind in classes_of("detector.generators", Generator)}  # type: ignore[type-abstract]
"""Every generator that a module of this folder defines, by the name of its class."""

__all__ = [
    "GENERATORS",
    "Estimation",
    "EvaluatedGenerator",
    "FaultTree",
    "Flow",
    "Fuzzy",
    "Generator",
    "KalmanResiduals",
    "Limits",
    "LinearPlant",
    "Luenberger",
    "MatchedFilters",
    "NeuralObserver",
    "Parity",
    "Rule",
    "Servo",
    "Spectrum",
    "Voting",
    "Waves",
    "dfd",
    "dfi",
    "explain",
    "full_order",
    "functional",
    "learn_estimation",
    "learn_flow",
    "learn_limits",
    "learn_neural",
    "learn_servo",
    "learn_spectrum",
    "learn_waves",
    "least_order",
    "settled",
    "static",
    "temporal",
]
