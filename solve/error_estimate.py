"""A record of how a result was computed, and the propagation of errors through a function."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class SolveInfo:
    """How a result was computed: the method, the number of unknowns, the wall-clock time [s] and a status message."""

    method: str
    dofs: int
    seconds: float
    status: str


def propagate_errors(function: Callable[..., float], values: Sequence[float], errors: Sequence[float]) -> float:
    """Return the half width of the error bar of function(*values), in the unit of the function.

    `errors` are the half widths of the error bars of `values`, in their units. The result is half the sum, over all
    arguments, of the absolute change in the function from value - error to value + error. If the function is nearly
    linear over the error bars, this is the worst case of simultaneous errors.
    """
    half_width = 0.0
    for i, error in enumerate(errors):
        high = list(values)
        low = list(values)
        high[i] += error
        low[i] -= error
        half_width += 0.5 * abs(function(*high) - function(*low))
    return half_width
