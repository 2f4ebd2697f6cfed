"""Student's t distribution, which widens the scatter that was estimated from few values."""

UPPER_END = 0.975
"""Probability below the upper end of the central 95 %."""


def student(freedom: int, holds: float = UPPER_END) -> float:
    """Return the quantile of Student's t distribution, by default at the upper end of the central 95 %."""
    from scipy.special import stdtrit  # slow to import, and a single press does not need it

    return float(stdtrit(freedom, holds))
