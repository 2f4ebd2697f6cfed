"""Student's distribution, by which few values of a scatter hold less than many."""

UPPER_END = 0.975
"""Below so much of a distribution lies the upper end of 95 %."""


def student(freedom: int, holds: float = UPPER_END) -> float:
    """Return the deviation below which Student's t lies with a probability, here at the upper end of 95 %."""
    from scipy.special import stdtrit  # it is slow to import, and a press alone does without

    return float(stdtrit(freedom, holds))
