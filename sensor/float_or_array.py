"""The type of what a function takes as a number or as an array, and returns in kind; it loads no NumPy."""

from typing import TYPE_CHECKING, TypeVar

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

FloatOrArray = TypeVar("FloatOrArray", float, "NDArray[np.float64]")
