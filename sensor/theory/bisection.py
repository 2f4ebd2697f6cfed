"""Where a condition ceases to hold, by halves: without SciPy, which a sizing need not load."""

from collections.abc import Callable

_HALVINGS = 200  # more than any two numbers need until none lies between them, unless one is 0


def last_holding(holds: Callable[[float], bool], start: float, end: float) -> float:
    """Return the number between two up to which a condition holds [their unit]: true at the start, not at the end."""
    for _ in range(_HALVINGS):
        middle = 0.5 * (start + end)
        if middle in (start, end):
            break
        if holds(middle):
            start = middle
        else:
            end = middle
    return end
