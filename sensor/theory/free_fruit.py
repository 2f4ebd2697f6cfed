"""Effects of a fruit that lies freely on a table: it is indented at the table, and unequal tips make it roll.

In the model of the sensor, the fruit is clamped at its base. Here the fruit is a ball. Units: N, mm, MPa.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from sensor.theory.bisection import end_of_true_range
from sensor.theory.hertz import approach

_STEADY_DEG = 5.0  # largest angle of the linear model; beyond it, the tips touch other parts of the fruit


def table_indentation_fraction(force: float, travel: float, E: float, poisson: float, radius: float) -> float:
    """Return the fraction [1] of the `travel` [mm] that is taken up by the indentation of the fruit at the table.

    `force` [N] is the total force of the tips at this travel on a clamped fruit. `E` [MPa] and `poisson` [1] are the
    modulus and Poisson's ratio of the flesh. `radius` [mm] is the radius of the fruit at the table. The indentation at
    the table reduces the force in proportion, so the fraction solves

        fraction = approach(force (1 - fraction)) / travel,

    where `approach` is Hertz's law. The right side decreases with the fraction, so there is one root, which is found by
    bisection.
    """

    def is_below_root(fraction: float) -> bool:
        """Return whether the right side is larger than this fraction, so that the root is larger too."""
        return approach(force * (1.0 - fraction), E, poisson, radius) / travel > fraction

    return end_of_true_range(is_below_root, 0.0, 1.0)


@dataclass(frozen=True, kw_only=True)
class Roll:
    """The roll of a ball on a table along the line of the tips, caused by the forces of the tips.

    `lever_mm` is the distance of the resultant force from the apex. `resistance` [N/mm] is the restoring force per
    distance of roll; if it is not positive, the ball rolls away. `angle_deg` is the angle of roll, infinite if the ball
    rolls away. `friction` is the smallest coefficient of friction [1] at the tips and the table that prevents the roll.
    """

    lever_mm: float
    resistance: float
    angle_deg: float
    friction: float

    @property
    def steady(self) -> bool:
        """Return whether the ball comes to rest at a small angle without friction at the tips."""
        return abs(self.angle_deg) <= _STEADY_DEG


def roll(forces: Sequence[float], places: Sequence[float], stiffness: Sequence[float], radius: float) -> Roll:
    """Return the roll of a ball of `radius` R [mm] on a table, under tips at `places` x [mm] from the apex.

    Each tip presses with a vertical force F, its entry of `forces` [N]. Its `stiffness` k [N/mm] is the stiffness of
    its spring and the flesh in series. Rolling by u moves the point of support by u. Rolling also lifts the skin under
    a tip by x u / R, which presses this tip harder. So the moment about the support [N mm] is

        sum(F x) - u (sum F - sum(k x^2) / R).

    The moment is 0 in equilibrium. A friction force H at the tips resists the roll with the moment 2 R H.
    """
    total_force = sum(forces)
    moment = sum(force * x for force, x in zip(forces, places, strict=True))
    destabilising_force = sum(k * x**2 for k, x in zip(stiffness, places, strict=True)) / radius  # sum(k x^2) / R
    resistance = total_force - destabilising_force
    rolls_away = not resistance > 0.0
    angle = math.inf if rolls_away else math.degrees(moment / resistance / radius)
    friction = abs(moment) / (2.0 * radius * total_force)
    return Roll(lever_mm=moment / total_force, resistance=resistance, angle_deg=angle, friction=friction)
