"""The methods, one a file. A new one is a file with one function and its place in `METHODS`."""

from identification.loops.methods.area_ratio import area_ratio
from identification.loops.methods.bicoherence import bicoherence
from identification.loops.methods.contract import Cycles, Method, MethodAnswer
from identification.loops.methods.cross_correlation import cross_correlation
from identification.loops.methods.curve_fit import curve_fit
from identification.loops.methods.hammerstein import hammerstein_answer
from identification.loops.methods.hammerstein_fit import HammersteinFit
from identification.loops.methods.parallelogram import parallelogram
from identification.loops.methods.relay_fit import relay_fit
from identification.loops.methods.shape import shape
from identification.loops.methods.stiction_search import StictionSearch, search

METHODS: tuple[Method, ...] = (
    cross_correlation, shape, curve_fit, relay_fit, area_ratio, bicoherence, parallelogram,
)  # fmt: skip
"""Every method that has its answer from the data at once; the search of `hammerstein` is the last in the answer."""

__all__ = [
    "METHODS",
    "Cycles",
    "HammersteinFit",
    "Method",
    "MethodAnswer",
    "StictionSearch",
    "hammerstein_answer",
    "search",
]
