"""Information on a solve, and the propagation of errors through a function."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class SolveInfo:
    """The solution method of a result: its name, its unknowns [1], its wall time [s], and a sentence on its quality."""

    method: str
    dofs: int
    seconds: float
    status: str


def propagate_errors(function: Callable[..., float], values: Sequence[float], errors: Sequence[float]) -> float:
    """Return the half width of the error bar of function(*values) [its unit], given the half widths of its arguments.

    All arguments have their worst error at once, and the function is treated as linear over the bars. The result is the
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
