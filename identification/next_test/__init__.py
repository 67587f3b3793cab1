"""The experiment that would tell: the sequence of forces, pressures or set points that teaches most within limits."""

from identification.next_test.bounds import DRIVES, DesignBounds, DrivenBy, bounds_of
from identification.next_test.drive import StemDrive, drive_of
from identification.next_test.expectation import Expectation
from identification.next_test.knowledge import DrivenTest, KnownValve, known_valve
from identification.next_test.procedure import next_test
from identification.next_test.proposal import NextTest
from identification.next_test.rivals import models_of, models_of_trace
from identification.next_test.waveforms import REFERENCES, WAVEFORMS

__all__ = [
    "DRIVES",
    "REFERENCES",
    "WAVEFORMS",
    "DesignBounds",
    "DrivenBy",
    "DrivenTest",
    "Expectation",
    "KnownValve",
    "NextTest",
    "StemDrive",
    "bounds_of",
    "drive_of",
    "known_valve",
    "models_of",
    "models_of_trace",
    "next_test",
]
