"""Types of NumPy arrays, and their conversion to tuples."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.integer[Any]]
Flags = NDArray[np.bool_]


def rows_of(matrix: Floats | Sequence[Sequence[float]]) -> tuple[tuple[float, ...], ...]:
    """Return a matrix as a tuple of its rows, each of them a tuple of floats."""
    return tuple(tuple(row) for row in np.asarray(matrix, dtype=np.float64).tolist())
