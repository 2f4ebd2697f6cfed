"""Large deflection of guided leaves by the elastica: exact for thin leaves, by series without cancellation."""

from dataclasses import dataclass

import numpy as np

from sensor.arrays import Floats
from sensor.quantity import Bounds, validation_error

_DEFLECTIONS = Bounds(at_least=0.0, at_most=0.5)  # deflection over length; no leaf bends as far as 0.5
_SINES = Bounds(at_least=0.0, below=1.0)
_ROUND_OFF = 1e-17
_SETTLED = 4.0 * float(np.finfo(np.float64).eps)  # relative change of a deflection at convergence
_STEPS = 40  # most steps; each reduces the error to a quarter or less


@dataclass(frozen=True, kw_only=True)
class Cantilever:
    """A cantilever of unit length and unit EI under a transverse force at its end: force and deflection of the end.

    `stiffening` is the force over 3 times the deflection (the law of small deflections), less one. The three arrays
    have one shape.
    """

    force: Floats
    deflection: Floats
    stiffening: Floats


def cantilever(sine: Floats | float) -> Cantilever:
    """Return the cantilever whose end has rotated by the angle with this sine [1], for an array of any shape.

    Raises InputError for a sine below 0 or from 1 on. With s = sine the force is 2 s I^2 and the deflection s J / I.
    Over 0 < v < 1, I is the integral of 1 / q, J the integral of (1 - v^2) / q, and q = sqrt(1 - s^2 (1 - v^2)^2). They
    are the elliptic integrals of K. E. Bisshopp and D. C. Drucker, Quart. Appl. Math. 3, 1945, with s (1 - v^2) as the
    sine of the slope.
    """
    sine = np.asarray(sine, dtype=np.float64)
    _refuse_outside("sine of the end's slope", sine, _SINES, "press less")
    # With I = 1 + a and J = 2/3 (1 + b), nothing below subtracts numbers that are nearly equal.
    a, b = _integrals_less_one(np.asarray(sine * sine))
    return Cantilever(
        force=2.0 * sine * (1.0 + a) ** 2,
        deflection=2.0 / 3.0 * sine * (1.0 + b) / (1.0 + a),
        stiffening=(3.0 * a + 3.0 * a * a + a**3 - b) / (1.0 + b),
    )


def _refuse_outside(name: str, values: Floats, bounds: Bounds, hint: str) -> None:
    """Raise InputError if any of the values lies outside its bounds [1]."""
    for value in (float(values.min()), float(values.max())):
        if not bounds.hold(value):
            raise validation_error(name, value, "1", str(bounds), hint)


def _integrals_less_one(square: Floats) -> tuple[Floats, Floats]:
    """Return I - 1 and 1.5 J - 1 of `cantilever` from s^2, the square of the sine.

    1 / q is a binomial series in x = s^2 (1 - v^2)^2, which is integrated term by term.
    """
    a = b = np.zeros_like(square)
    binomial = np.ones_like(square)
    odd = 2.0 / 3.0  # integral of 1 - v^2
    n = 0
    while True:
        n += 1
        binomial = binomial * square * (2 * n - 1) / (2 * n)  # coefficient of x^n in 1 / sqrt(1 - x), times s^(2 n)
        even = odd * 4 * n / (4 * n + 1)  # integral of (1 - v^2)^(2 n)
        odd = even * (4 * n + 2) / (4 * n + 3)  # integral of (1 - v^2)^(2 n + 1)
        a = a + binomial * even
        b = b + 1.5 * binomial * odd
        # Terms decrease faster than the powers of s^2, so the remaining terms sum to less than this.
        if (binomial * square / (1.0 - square) <= _ROUND_OFF * a).all():
            return a, b


def large_deflection_stiffening(length: float, deflection: Floats | float) -> Floats:
    """Return the relative increase of the secant stiffness of a guided leaf at deflections d [1 from mm].

    It is 36/35 (d / L)^2 for small d, with L the length, and the same for a pair. The shuttle is free along the leaves
    and does not rotate. So each half of a leaf is a cantilever of length L / 2 with the deflection d / 2. Raises
    InputError beyond d = L / 2.
    """
    relative = np.asarray(deflection, dtype=np.float64) / length
    _refuse_outside("deflection / leaf length", relative, _DEFLECTIONS, "take a longer leaf or press less")
    # The deflection is nearly proportional to the sine: 2/3 of it while both are small.
    sine = 1.5 * relative
    for _ in range(_STEPS):
        bent = cantilever(sine)
        if (np.abs(bent.deflection - relative) <= _SETTLED * relative).all():
            break
        sine = sine * np.divide(relative, bent.deflection, out=np.ones_like(sine), where=bent.deflection > 0.0)
    return bent.stiffening
