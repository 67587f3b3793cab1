"""The classic residual generators of the source's Chapter 3, one file each, with one contract: `step`.

>>> from detector.generators import Limits
>>> limits = Limits(lower=(0.0,), upper=(10.0,))
>>> state, residuals = limits.step(limits.initial(), u=[], y=[5.0])
>>> residuals.tolist()
[0.0]
"""

from detector.generators.banks.parallel_lag import ParallelLag, learn_parallel_lag
from detector.generators.banks.scores import ScoreBank, learn_score_bank
from detector.generators.banks.structured import StructuredSet, all_but_one, isolates, one_each, structured
from detector.generators.banks.takagi_sugeno import TakagiSugeno, learn_takagi_sugeno, memberships
from detector.generators.banks.unknown_input import unknown_input
from detector.generators.contract import EvaluatedGenerator, Generator
from detector.generators.drive.physical_parameters import PhysicalParameters, learn_physical
from detector.generators.drive.servo import Servo, learn_servo
from detector.generators.drive.waves import Waves, learn_waves
from detector.generators.envelope import Envelope, learn_envelope
from detector.generators.estimation import Estimation, learn_estimation
from detector.generators.fault_tree import FaultTree, Rule, explain
from detector.generators.flow import Flow, learn_flow
from detector.generators.fuzzy import Fuzzy
from detector.generators.innovation_form import InnovationForm, learn_innovation_form
from detector.generators.kalman import KalmanResiduals, MatchedFilters, settled
from detector.generators.limits import Limits, learn_limits
from detector.generators.luenberger import Luenberger, full_order, functional, least_order
from detector.generators.neural.dedicated import DedicatedNeural, learn_dedicated
from detector.generators.neural.observer import NeuralObserver, learn_neural
from detector.generators.neural.structure_search import EvolvedStructure, evolve_neural
from detector.generators.parity import Parity, dfd, dfi, static, temporal
from detector.generators.plant import LinearPlant
from detector.generators.spectrum import Spectrum, learn_spectrum
from detector.generators.voting import Voting
from recordings import classes_of

GENERATORS = {kind.__name__: kind for kind in classes_of("detector.generators", Generator)}  # type: ignore[type-abstract]
"""Every generator that a module of this folder defines, by the name of its class."""

__all__ = [
    "GENERATORS",
    "DedicatedNeural",
    "Envelope",
    "Estimation",
    "EvaluatedGenerator",
    "EvolvedStructure",
    "FaultTree",
    "Flow",
    "Fuzzy",
    "Generator",
    "InnovationForm",
    "KalmanResiduals",
    "Limits",
    "LinearPlant",
    "Luenberger",
    "MatchedFilters",
    "NeuralObserver",
    "ParallelLag",
    "Parity",
    "PhysicalParameters",
    "Rule",
    "ScoreBank",
    "Servo",
    "Spectrum",
    "StructuredSet",
    "TakagiSugeno",
    "Voting",
    "Waves",
    "all_but_one",
    "dfd",
    "dfi",
    "evolve_neural",
    "explain",
    "full_order",
    "functional",
    "isolates",
    "learn_dedicated",
    "learn_envelope",
    "learn_estimation",
    "learn_flow",
    "learn_innovation_form",
    "learn_limits",
    "learn_neural",
    "learn_parallel_lag",
    "learn_physical",
    "learn_score_bank",
    "learn_servo",
    "learn_spectrum",
    "learn_takagi_sugeno",
    "learn_waves",
    "least_order",
    "memberships",
    "one_each",
    "settled",
    "static",
    "structured",
    "temporal",
    "unknown_input",
]
