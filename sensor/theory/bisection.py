"""Find the end of the range in which a condition holds, by bisection. Without SciPy, sizing starts faster."""

from collections.abc import Callable

_HALVINGS = 200  # enough to reach adjacent floats from any two numbers unless one of them is 0


def end_of_true_range(holds: Callable[[float], bool], start: float, end: float) -> float:
    """Return the number up to which a condition holds. The condition must be true at `start` and false at `end`."""
    for _ in range(_HALVINGS):
        middle = 0.5 * (start + end)
        if middle in (start, end):
            break
        if holds(middle):
            start = middle
        else:
            end = middle
    return end
