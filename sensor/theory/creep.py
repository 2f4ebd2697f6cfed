"""Springs of plastic that creep: the stiffness that a weight finds and that of a press, and the zero a press leaves.

Under a load that stays, the compliance of a print grows by the same share c [1] in each decade of time,

    J(t) = J(1 s) t^n,    n = log10(1 + c),

and all springs of one print have one law, so all stiffnesses change alike. Loads superpose (Boltzmann): a history F(s)
deflects by the integral of J(t - s) dF(s). W. N. Findley, J. S. Lai, K. Onaran, Creep and Relaxation of Nonlinear
Viscoelastic Materials (1976), on the power law and on superposition.

**A weight** that hangs for t has K(t) = K(1 s) t^-n.

**A press.** A force that rises evenly for T is answered with J(T) / (1 + n), the mean of J. A hand slows to its stop,
x = X (1 - (1 - t / T)^2). To the first order in n, force over deflection there is K(T / sqrt(e)). The rise of a press
tells slopes, by which late samples count in another way. For hands and even presses, with contacts of flat tips and of
domes, it tells K of a time from T / 3 to 1.6 T. So K(T / sqrt(e)) is taken for all of them, a time within a factor e.

**What E moves by.** Channels show deflections, scaled to forces by weights. So forces are too small in a press, all by
the ratio k of both stiffnesses, and so is the modulus. Deflections, and what drops out of them, are right.

**The hold.** A force that rose evenly for T and stays for h has deflected springs, over what it did at its stop, by

    g(h) = (1 + h/T)^(1 + n) - (h/T)^(1 + n),

the mean of J. A hold keeps the travel: the force falls meanwhile, by which g is off by (g - 1)^2 at most.

**The zero.** By superposition, a press that lasted T leaves at most J(s + T) - J(s) of its largest force, a time s
after its lift. J rises ever more slowly, so a force that stayed at its largest leaves most.
"""

import math
from dataclasses import dataclass

from sensor.quantity import BOUNDED, COVERAGE
from sensor.words import with_bar

EFFECTIVE = math.exp(-0.5)
"""Of the duration of a press: when a weight would meet the same stiffness."""


@dataclass(frozen=True)
class CreepLaw:
    """The share [1] by which the compliance of a print grows in a decade of time, and its standard deviation [1]."""

    per_decade: float = 0.0
    error: float = 0.0

    def __str__(self) -> str:
        """Return the law in words, with the half width that holds 95 %."""
        return f"{with_bar(100.0 * self.per_decade, 100.0 * COVERAGE * self.error, '%')} (95 %) a decade of time"

    @property
    def exponent(self) -> float:
        """Return n of J(t) = J(1 s) t^n [1]."""
        return math.log10(1.0 + self.per_decade)

    def growth(self, begin: float, end: float) -> float:
        """Return the compliance at a time over that at an earlier one [1], both since the load came [s]."""
        return float((end / begin) ** self.exponent)

    def press_over_weighed(self, weighed_s: float, press_s: float) -> float:
        """Return k [1], the stiffness of a press over that of a weight that was read after `weighed_s` [s].

        `press_s` [s] is the duration of the press, from the first touch to the deepest point.
        """
        return self.growth(EFFECTIVE * press_s, weighed_s)

    def growth_in_hold(self, held_s: float, press_s: float) -> float:
        """Return g [1], the compliance of springs after a hold [s] over that at its begin.

        `press_s` [s] is the duration of the even press before it, from the first touch to the deepest point.
        """
        held = held_s / press_s
        return float((1.0 + held) ** (1.0 + self.exponent) - held ** (1.0 + self.exponent))

    def deviation(self, weighed_s: float, press_s: float) -> float:
        """Return the standard deviation of ln k [1]: by the law, and by the effective time within a factor e."""
        decades = math.log10(weighed_s / (EFFECTIVE * press_s))
        return math.hypot(decades * self.error / (1.0 + self.per_decade), BOUNDED * self.exponent)

    def left_behind(self, since_s: float, press_s: float, lasted_s: float) -> float:
        """Return what is left of the largest deflection of a press [1], at most, a time [s] after its lift.

        It lasted `lasted_s` [s] from the first touch to the lift, and `press_s` [s] of them to the deepest point.
        """
        n = self.exponent
        return float(((since_s + lasted_s) ** n - since_s**n) / (EFFECTIVE * press_s) ** n)


NO_CREEP = CreepLaw()
"""That of metals."""
