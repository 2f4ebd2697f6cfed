"""What a whole fruit that lies free on a table adds: its contact with the table gives way, and unequal tips roll it.

The sensor is modelled on a fruit that is clamped at its base. Here the fruit is a ball. Units: N, mm, MPa.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from sensor.theory.bisection import last_holding
from sensor.theory.hertz import approach

_STEADY_DEG = 5.0  # beyond, the tips no longer stand where they stood, and a linear angle means nothing


def table_share(force: float, travel: float, E: float, poisson: float, radius: float) -> float:
    """Return the share of the travel [mm] that the table takes [1].

    `force` [N] is that of all tips at this travel on the clamped fruit. What the table takes lowers the force in
    proportion: share = approach(force (1 - share)) / travel, whose right side falls, so that there is one answer.
    """

    def takes_more(fraction: float) -> bool:
        return approach(force * (1.0 - fraction), E, poisson, radius) / travel > fraction

    return last_holding(takes_more, 0.0, 1.0)


@dataclass(frozen=True, kw_only=True)
class Roll:
    """What tips do to a ball that is free to roll along them on its table.

    `lever_mm` is how far beside the apex their resultant force passes. `resistance` [N/mm] is the force that resists
    each mm of roll; where it is not positive, the ball runs away. `angle_deg` is how far it rolls, infinite where it
    runs away. `friction` is the coefficient [1] at the tips and at the table from which on nothing rolls.
    """

    lever_mm: float
    resistance: float
    angle_deg: float
    friction: float

    @property
    def steady(self) -> bool:
        """Say whether the ball comes to rest at a small angle without friction at the tips."""
        return abs(self.angle_deg) <= _STEADY_DEG


def roll(forces: Sequence[float], places: Sequence[float], stiffness: Sequence[float], radius: float) -> Roll:
    """Return how tips at places x [mm] from the apex roll a ball of a radius [mm] along x.

    `forces` [N] are vertical, `stiffness` [N/mm] is that of each tip's spring and flesh in series. Rolling by u moves
    the point of support by u. It lifts the skin under a tip by x u / R, which presses that tip harder. The moment about
    the support is sum F x - u (sum F - sum k x^2 / R). Friction H at the tips resists rolling with the moment 2 R H.
    """
    total = sum(forces)
    moment = sum(force * x for force, x in zip(forces, places, strict=True))
    pressed = sum(k * x**2 for k, x in zip(stiffness, places, strict=True)) / radius
    resistance = total - pressed
    angle = math.inf
    if resistance > 0.0:
        angle = math.degrees(moment / resistance / radius)
    friction = abs(moment) / (2.0 * radius * total)
    return Roll(lever_mm=moment / total, resistance=resistance, angle_deg=angle, friction=friction)
