"""Type aliases for NumPy arrays, and the conversion of a matrix to tuples."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.integer[Any]]
Flags = NDArray[np.bool_]


def rows_of(matrix: Floats | Sequence[Sequence[float]]) -> tuple[tuple[float, ...], ...]:
    """Return a matrix as a tuple of rows, each a tuple of floats."""
    return tuple(tuple(row) for row in np.asarray(matrix, dtype=np.float64).tolist())
