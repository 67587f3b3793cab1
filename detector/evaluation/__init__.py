"""All detectors on the benchmark's scenarios, at one rate of false alarms; which fault it is; what nobody can see."""

from detector.evaluation._alarm import Levels, alarms, calibrate, largest
from detector.evaluation._detectors import DETECTORS, Detector, Seen
from detector.evaluation._diagnosis import Diagnosis, learn_diagnosis, portrait
from detector.evaluation._examples import Example, examples
from detector.evaluation._indices import Indices, Zone, chance, indices, misisolation
from detector.evaluation._plan import BENCHMARK, MAIN, SMOKE, VARIANTS, Plan, smoke
from detector.evaluation._plant import RATES, SIGNALS, Setting, elsewhere, healthy, simulate, with_fault
from detector.evaluation._plant_hour import count_alarms, plant_hour
from detector.evaluation._structure import groups as structural_groups
from detector.evaluation._structure import signatures as structural_signatures
from detector.evaluation._study import Outcome, evaluate
from detector.evaluation._symptoms import Symptoms, learn_symptoms
from detector.evaluation._tables import Table, detected, isolation_words, plant_table, right, tables
from detector.evaluation._write import write

__all__ = [
    "BENCHMARK",
    "DETECTORS",
    "MAIN",
    "RATES",
    "SIGNALS",
    "SMOKE",
    "VARIANTS",
    "Detector",
    "Diagnosis",
    "Example",
    "Indices",
    "Levels",
    "Outcome",
    "Plan",
    "Seen",
    "Setting",
    "Symptoms",
    "Table",
    "Zone",
    "alarms",
    "calibrate",
    "chance",
    "count_alarms",
    "detected",
    "elsewhere",
    "evaluate",
    "examples",
    "healthy",
    "indices",
    "isolation_words",
    "largest",
    "learn_diagnosis",
    "learn_symptoms",
    "misisolation",
    "plant_hour",
    "plant_table",
    "portrait",
    "right",
    "simulate",
    "smoke",
    "structural_groups",
    "structural_signatures",
    "tables",
    "with_fault",
    "write",
]
