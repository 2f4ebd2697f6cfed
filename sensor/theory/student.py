"""Student's t distribution, for standard deviations that are estimated from few values."""

UPPER_END = 0.975
"""Cumulative probability at the upper end of the central 95 % interval."""


def student_quantile(freedom: int, probability: float = UPPER_END) -> float:
    """Return the quantile of Student's t distribution with `freedom` degrees of freedom at a cumulative probability.

    By default, it is the upper end of the central 95 % interval.
    """
    from scipy.special import stdtrit  # slow to import, and a single press does not need it

    return float(stdtrit(freedom, probability))
