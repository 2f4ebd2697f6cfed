"""Flesh that relaxes at a constant Poisson's ratio, described by its Prony series.

Under a constant indentation, the force decays in proportion to

    g(t) = 1 - sum_i g_i (1 - exp(-t / tau_i)).

All moduli are instantaneous: they apply before the flesh has relaxed. See E. H. Lee, J. R. M. Radok, The contact
problem for viscoelastic bodies, J. Appl. Mech. 27 (1960) 438, doi:10.1115/1.3644020.
"""

import math
from dataclasses import dataclass

from sensor.quantity import validation_error

FORM = "a list of pairs [share, time_s], with times above 0, and with shares above 0 that add up to less than 1"
_HINT = "for flesh that loses 0.3 of the force within seconds and 0.2 within a minute, write [[0.3, 2.0], [0.2, 60.0]]"


@dataclass(frozen=True)
class Relaxation:
    """The arms of a Prony series. In arm i, a share g_i [1] of the force decays with the time constant tau_i [s]."""

    arms: tuple[tuple[float, float], ...]

    def __post_init__(self) -> None:
        """Raise InputError unless the arms are pairs (share, time) whose shares add up to less than 1."""
        if not _are_arms(self.arms):
            raise validation_error("fruit.relaxation", self.arms, "", FORM, _HINT)
        total = sum(self.shares)
        if not total < 1.0:
            bound = "fractions that add up to less than 1"
            raise validation_error("fruit.relaxation", total, "", bound, "a part of the force must remain")

    @property
    def shares(self) -> tuple[float, ...]:
        """Return the shares g_i [1]."""
        return tuple(share for share, _ in self.arms)

    @property
    def times(self) -> tuple[float, ...]:
        """Return the times tau_i [s]."""
        return tuple(time for _, time in self.arms)

    @property
    def left(self) -> float:
        """Return the share of the force that never decays [1]."""
        return 1.0 - sum(self.shares)


def _are_arms(arms: object) -> bool:
    """Return whether a value is a tuple of at least one arm."""
    return isinstance(arms, tuple) and len(arms) > 0 and all(map(_is_arm, arms))


def _is_arm(arm: object) -> bool:
    """Return whether a value is a pair of numbers: a share between 0 and 1, and a finite time above 0."""
    if not isinstance(arm, tuple) or len(arm) != 2:  # noqa: PLR2004 - a pair
        return False
    are_numbers = all(isinstance(value, int | float) and not isinstance(value, bool) for value in arm)
    return are_numbers and 0.0 < arm[0] < 1.0 and 0.0 < arm[1] < math.inf


ASSUMED_RELAXATION = Relaxation(((0.25, 5.0), (0.33, 120.0)))
"""Relaxation assumed for an uncertainty if a design has no `fruit.relaxation`. The flesh keeps 42 % of a force, like
Tarocco oranges: M. Moresi et al., Food Bioprocess Technol. 5 (2012), doi:10.1007/s11947-011-0528-4. The two times
and the division into two shares are a judgement."""
STATED_SPREAD = 0.3
"""Relative deviation of a fruit from the stated relaxation, by judgement."""
