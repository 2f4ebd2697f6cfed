"""Creep of plastic springs: their stiffness under a weight and in a press, and the zero shift after a press.

Under a constant load, the compliance of a printed spring grows by the same fraction c [1] in each decade of time,

    J(t) = J(1 s) t^n,    n = log10(1 + c).

All springs of one print follow the same law, so all stiffnesses change by one common factor. Loads superpose
(Boltzmann): under a force history F(s), the deflection is the integral of J(t - s) dF(s). For the power law and for
superposition see W. N. Findley, J. S. Lai, K. Onaran, Creep and Relaxation of Nonlinear Viscoelastic Materials (1976).

**A weight** that has been hanging for a time t measures the stiffness K(t) = K(1 s) t^-n.

**A press.** Under a force that rises linearly for a time T, the compliance is J(T) / (1 + n), the mean of J. A hand
slows down before it stops: x = X (1 - (1 - t / T)^2). To first order in n, the force divided by the deflection at the
stop is then K(T / sqrt(e)). A press is read from slopes, which weight late samples differently. For presses by hand and
at constant speed, with flat tips and domes, the stiffness is K at a time between T / 3 and 1.6 T. So K(T / sqrt(e)) is
used for every press. The time T / sqrt(e) is known within a factor of e.

**The modulus.** Channels measure deflections, and the calibration with weights converts them to forces. So all forces
of a press are too small by the ratio k of the two stiffnesses, and so is the modulus. Deflections and their contrasts
are correct.

**The hold.** If a force rises linearly for T and is then held for h, the deflection grows by the factor

    g(h) = (1 + h/T)^(1 + n) - (h/T)^(1 + n),

which is the mean of J at the end of the hold divided by the mean of J at the stop. A hand keeps the travel constant
instead, so the force falls during the hold. The error of g is then at most (g - 1)^2.

**The zero.** By superposition, a press of duration T shifts the zero at a time s after its lift. The shift is at most
J(s + T) - J(s) times the largest force. J grows more and more slowly, so the shift is largest if the force stays at its
maximum during the whole press.
"""

import math
from dataclasses import dataclass

from sensor.quantity import COVERAGE, UNIFORM_DEVIATION
from sensor.words import value_with_bar

EFFECTIVE = math.exp(-0.5)
"""Time at which a hanging weight measures the stiffness of a press, divided by the duration of the press."""


@dataclass(frozen=True)
class CreepLaw:
    """The fraction [1] by which the compliance of a print grows per decade of time, and its standard deviation [1]."""

    per_decade: float = 0.0
    error: float = 0.0

    def __str__(self) -> str:
        """Return the law as text, with the half width of the 95 % interval."""
        return (
            f"{value_with_bar(100.0 * self.per_decade, 100.0 * COVERAGE * self.error, '%')} (95 %) per decade of time"
        )

    @property
    def exponent(self) -> float:
        """Return the exponent n [1] of J(t) = J(1 s) t^n."""
        return math.log10(1.0 + self.per_decade)

    def growth(self, begin: float, end: float) -> float:
        """Return the compliance at `end` divided by the compliance at `begin` [1]; both are times since loading [s]."""
        return float((end / begin) ** self.exponent)

    def press_stiffness_ratio(self, weighed_s: float, press_s: float) -> float:
        """Return k [1]: the stiffness in a press divided by the stiffness under a weight, read after `weighed_s` [s].

        `press_s` [s] is the duration of the press, from the first touch to the deepest point.
        """
        return self.growth(EFFECTIVE * press_s, weighed_s)

    def growth_in_hold(self, held_s: float, press_s: float) -> float:
        """Return g [1]: the compliance of springs after a hold of `held_s` [s], divided by their compliance before it.

        `press_s` [s] is the duration of the press before the hold, from the first touch to the deepest point. The press
        is assumed to have a constant speed.
        """
        held = held_s / press_s
        return float((1.0 + held) ** (1.0 + self.exponent) - held ** (1.0 + self.exponent))

    def deviation(self, weighed_s: float, press_s: float) -> float:
        """Return the standard deviation of ln k [1] caused by the error of the law and of the effective time.

        The effective time is known within a factor of e.
        """
        decades = math.log10(weighed_s / (EFFECTIVE * press_s))
        return math.hypot(decades * self.error / (1.0 + self.per_decade), UNIFORM_DEVIATION * self.exponent)

    def residual_deflection(self, since_s: float, press_s: float, lasted_s: float) -> float:
        """Return an upper bound for the deflection left at `since_s` [s] after the lift of a press.

        The bound is a fraction [1] of the largest deflection of the press. `lasted_s` [s] is the time from the first
        touch to the lift, and `press_s` [s] the time from the first touch to the deepest point.
        """
        n = self.exponent
        return float(((since_s + lasted_s) ** n - since_s**n) / (EFFECTIVE * press_s) ** n)


NO_CREEP = CreepLaw()
"""The law of metals, whose creep is negligible."""
