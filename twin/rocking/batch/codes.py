"""Outcomes of many cells as numbers, and the arrays they are written to."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Codes = NDArray[np.uint8]
Counts = NDArray[np.int32]
Signs = NDArray[np.int8]
Numbers = NDArray[np.int64]

# UNSETTLED, of the quick look alone, asks for the accurate one; DOUBTFUL is what that adds to an outcome which it
# cannot be sure of either.
STAYED, ROCKED, OVERTURNED, UNDECIDED, IMPOSSIBLE, UNSETTLED = range(6)
DOUBTFUL = 16
