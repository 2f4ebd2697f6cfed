"""What a solve says of itself, and how errors of numbers reach what follows from them."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class SolveInfo:
    """How a result was computed: the method, its unknowns [1], its wall time [s], and a sentence on its quality."""

    method: str
    dofs: int
    seconds: float
    status: str


def propagate_errors(function: Callable[..., float], values: Sequence[float], errors: Sequence[float]) -> float:
    """Return the half width of the error bar of function(*values) [its unit], given those of its arguments.

    All arguments are off at their worst at once, and the function counts as linear over their bars. The result is the
    sum over the arguments of half the change from value - error to value + error.
    """
    total = 0.0
    for i, error in enumerate(errors):
        high = list(values)
        low = list(values)
        high[i] += error
        low[i] -= error
        total += 0.5 * abs(function(*high) - function(*low))
    return total
