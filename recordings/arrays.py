"""The array types of the house: real numbers in double precision, whole numbers, and places in other arrays."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
"""An array of 64-bit floats; docstrings give shape and unit."""

Integers = NDArray[np.int64]
"""An array of whole numbers: counts, codes, numbers of steps."""

IndexArray = NDArray[np.intp]
"""An array of places in another array, as numpy gives them."""
