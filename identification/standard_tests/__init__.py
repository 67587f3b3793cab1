"""The standard tests of a control valve from recordings: step response, dead band, signature, partial stroke."""

from identification.standard_tests.interval import LEVEL, Interval
from identification.standard_tests.procedure import KINDS, TestKind, standard_test
from identification.standard_tests.result import ValveTest, reference_values
from identification.standard_tests.simulated import simulated_test

__all__ = ["KINDS", "LEVEL", "Interval", "TestKind", "ValveTest", "reference_values", "simulated_test", "standard_test"]
