"""The experiment that would tell: the sequence of forces, pressures or set points that teaches most within limits."""

from identification.next_test.bounds import DRIVES, DesignBounds, Drive, bounds_of
from identification.next_test.expectation import Expectation
from identification.next_test.known_valve import KnownValve
from identification.next_test.procedure import next_test
from identification.next_test.proposal import NextTest
from identification.next_test.rivals import models_of, models_of_trace

__all__ = [
    "DRIVES",
    "DesignBounds",
    "Drive",
    "Expectation",
    "KnownValve",
    "NextTest",
    "bounds_of",
    "models_of",
    "models_of_trace",
    "next_test",
]
