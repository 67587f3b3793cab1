"""All detectors on the benchmark's scenarios, at one rate of false alarms; which fault it is; what nobody can see."""

from detector.evaluation.benchmark.fault_examples import Example, examples
from detector.evaluation.benchmark.measured_hour import count_alarms, plant_hour
from detector.evaluation.benchmark.runs import RATES, SIGNALS, Setting, healthy, random_start, simulate, with_fault
from detector.evaluation.contract import BenchmarkRun, Channels, Detector, LearnedDetector
from detector.evaluation.detectors import DETECTORS
from detector.evaluation.isolation.diagnosis import Diagnosis, feature_vectors, learn_diagnosis
from detector.evaluation.isolation.structure import groups as structural_groups
from detector.evaluation.isolation.structure import signatures as structural_signatures
from detector.evaluation.isolation.symptoms import Symptoms, learn_symptoms
from detector.evaluation.levels import Levels, alarms, calibrate, largest
from detector.evaluation.linear import inputs, linearise, outputs
from detector.evaluation.outcome import Evaluation
from detector.evaluation.performance import Indices, Zone, chance, indices, misisolation
from detector.evaluation.plan import BENCHMARK, MAIN, SMOKE, VARIANTS, Plan, smoke
from detector.evaluation.results.files import write
from detector.evaluation.results.isolation_rows import isolation_words
from detector.evaluation.results.rows import plant_table, tables
from detector.evaluation.results.table import ResultTable
from detector.evaluation.results.verdicts import correctly_isolated, detected
from detector.evaluation.study import evaluate

__all__ = [
    "BENCHMARK",
    "DETECTORS",
    "MAIN",
    "RATES",
    "SIGNALS",
    "SMOKE",
    "VARIANTS",
    "BenchmarkRun",
    "Channels",
    "Detector",
    "Diagnosis",
    "Evaluation",
    "Example",
    "Indices",
    "LearnedDetector",
    "Levels",
    "Plan",
    "ResultTable",
    "Setting",
    "Symptoms",
    "Zone",
    "alarms",
    "calibrate",
    "chance",
    "correctly_isolated",
    "count_alarms",
    "detected",
    "evaluate",
    "examples",
    "feature_vectors",
    "healthy",
    "indices",
    "inputs",
    "isolation_words",
    "largest",
    "learn_diagnosis",
    "learn_symptoms",
    "linearise",
    "misisolation",
    "outputs",
    "plant_hour",
    "plant_table",
    "random_start",
    "simulate",
    "smoke",
    "structural_groups",
    "structural_signatures",
    "tables",
    "with_fault",
    "write",
]
