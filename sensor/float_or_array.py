"""The type of an argument that is a number or an array, if the result is of the same kind; it loads no NumPy."""

from typing import TYPE_CHECKING, TypeVar

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

FloatOrArray = TypeVar("FloatOrArray", float, "NDArray[np.float64]")
