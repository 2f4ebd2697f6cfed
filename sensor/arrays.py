"""Types of arrays."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.integer[Any]]
Flags = NDArray[np.bool_]


def rows_of(matrix: Floats | Sequence[Sequence[float]]) -> tuple[tuple[float, ...], ...]:
    """Return a matrix as tuples of its rows, in its unit."""
    return tuple(tuple(row) for row in np.asarray(matrix, dtype=np.float64).tolist())
