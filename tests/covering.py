"""Fitted constants: each must cover what is measured for it anew, and not far too much."""

from collections.abc import Sequence


def covers(constant: float, seen: Sequence[float], spare: float = 3.0) -> bool:
    """Say whether a constant is at least the largest value that was seen, and at most `spare` times it."""
    largest = float(max(seen))
    return largest <= constant <= spare * largest
