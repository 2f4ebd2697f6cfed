"""A type variable for functions that return a number for a number and an array for an array.

This module does not load NumPy.
"""

from typing import TYPE_CHECKING, TypeVar

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

FloatOrArray = TypeVar("FloatOrArray", float, "NDArray[np.float64]")
