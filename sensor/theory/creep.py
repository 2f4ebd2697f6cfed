"""Plastic springs that creep: their stiffness under a hanging weight and in a press, and the zero after a press.

Under a constant load, the compliance of a print grows by the same share c [1] in each decade of time,

    J(t) = J(1 s) t^n,    n = log10(1 + c),

and all springs of one print have one law, so all stiffnesses change by one factor. Loads superpose (Boltzmann): under a
history F(s) the deflection is the integral of J(t - s) dF(s). W. N. Findley, J. S. Lai, K. Onaran, Creep and Relaxation
of Nonlinear Viscoelastic Materials (1976), on the power law and on superposition.

**A weight** that hangs for a time t measures K(t) = K(1 s) t^-n.

**A press.** Under a force that rises linearly for T, the compliance is J(T) / (1 + n), the mean of J. A hand slows to
its stop, x = X (1 - (1 - t / T)^2). To first order in n, force over deflection at the stop is K(T / sqrt(e)). A press
is read by slopes, which weight late samples differently. For presses by hand and at constant speed, with flat tips and
domes, the stiffness is K at a time from T / 3 to 1.6 T. So K(T / sqrt(e)) is used for all, with a time within a factor
e.

**The modulus.** Channels measure deflections, and weights scale them to forces. So all forces of a press are too small
by the ratio k of both stiffnesses, and so is the modulus. Deflections, and the contrasts of deflections, are correct.

**The hold.** A force that rose linearly for T and is then held for h increases the deflection by the factor

    g(h) = (1 + h/T)^(1 + n) - (h/T)^(1 + n),

the mean of J over the mean of J at the stop. A hold by hand keeps the travel, so the force falls meanwhile; the error
of g is then at most (g - 1)^2.

**The zero.** By superposition, a press that lasted T leaves at most J(s + T) - J(s) times its largest force, at a time
s after its lift. J rises more and more slowly, so a force that stayed at its largest leaves the most.
"""

import math
from dataclasses import dataclass

from sensor.quantity import BOUNDED, COVERAGE
from sensor.words import value_with_bar

EFFECTIVE = math.exp(-0.5)
"""Time at which a hanging weight measures the stiffness of a press, over the duration of the press."""


@dataclass(frozen=True)
class CreepLaw:
    """The share [1] by which the compliance of a print grows in a decade of time, and its standard deviation [1]."""

    per_decade: float = 0.0
    error: float = 0.0

    def __str__(self) -> str:
        """Return the law as text, with the half width of 95 % coverage."""
        return (
            f"{value_with_bar(100.0 * self.per_decade, 100.0 * COVERAGE * self.error, '%')} (95 %) per decade of time"
        )

    @property
    def exponent(self) -> float:
        """Return the exponent n [1] of J(t) = J(1 s) t^n."""
        return math.log10(1.0 + self.per_decade)

    def growth(self, begin: float, end: float) -> float:
        """Return the compliance at the time `end` over the compliance at `begin` [1], both times since loading [s]."""
        return float((end / begin) ** self.exponent)

    def press_over_weighed(self, weighed_s: float, press_s: float) -> float:
        """Return k [1], the stiffness of a press over that of a weight that was read after `weighed_s` [s].

        `press_s` [s] is the duration of the press, from the first touch to the deepest point.
        """
        return self.growth(EFFECTIVE * press_s, weighed_s)

    def growth_in_hold(self, held_s: float, press_s: float) -> float:
        """Return g [1], the compliance of springs after a hold [s] over their compliance at its begin.

        `press_s` [s] is the duration of the press before it, at constant speed, from the first touch to the deepest
        point.
        """
        held = held_s / press_s
        return float((1.0 + held) ** (1.0 + self.exponent) - held ** (1.0 + self.exponent))

    def deviation(self, weighed_s: float, press_s: float) -> float:
        """Return the standard deviation of ln k [1], due to the law and to the effective time.

        The effective time is known to a factor e.
        """
        decades = math.log10(weighed_s / (EFFECTIVE * press_s))
        return math.hypot(decades * self.error / (1.0 + self.per_decade), BOUNDED * self.exponent)

    def left_behind(self, since_s: float, press_s: float, lasted_s: float) -> float:
        """Return the part of its largest deflection [1] that a press leaves at most at `since_s` [s] after its lift.

        `lasted_s` [s] is the time from the first touch to the lift, `press_s` [s] the time to the deepest point.
        """
        n = self.exponent
        return float(((since_s + lasted_s) ** n - since_s**n) / (EFFECTIVE * press_s) ** n)


NO_CREEP = CreepLaw()
"""The law of metals, which do not creep."""
