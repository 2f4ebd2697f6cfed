"""Large deflection of guided leaves by the elastica, which is exact for thin leaves."""

import itertools
from dataclasses import dataclass

import numpy as np

from sensor.arrays import Floats
from sensor.quantity import Bounds, validation_error

_DEFLECTIONS = Bounds(at_least=0.0, at_most=0.5)  # deflection divided by length; no leaf bends as far as 0.5
_SINES = Bounds(at_least=0.0, below=1.0)
_ROUND_OFF = 1e-17  # largest sum of the neglected terms of a series, relative to the series
_CONVERGED = 4.0 * float(np.finfo(np.float64).eps)  # relative error of a deflection at convergence
_MAX_STEPS = 40  # each iteration reduces the error to at most a quarter


@dataclass(frozen=True, kw_only=True)
class Cantilever:
    """A cantilever of unit length and unit bending stiffness EI, under a transverse force at its end.

    `force` and `deflection` refer to the end. `stiffening` is the relative increase of the secant stiffness over the
    stiffness at small deflections, force / (3 deflection) - 1. The three arrays have the same shape.
    """

    force: Floats
    deflection: Floats
    stiffening: Floats


def cantilever(sine: Floats | float) -> Cantilever:
    """Return the force and the deflection of a cantilever from the sine [1] of the rotation angle of its end.

    With s = `sine`, an array of any shape, the force is 2 s I^2 and the deflection is s J / I. Over 0 < v < 1, I is the
    integral of 1 / q and J the integral of (1 - v^2) / q, with q = sqrt(1 - s^2 (1 - v^2)^2). These are the elliptic
    integrals of K. E. Bisshopp and D. C. Drucker, Quart. Appl. Math. 3, 1945, with s (1 - v^2) as the sine of the slope
    along the leaf. Raises InputError unless 0 <= s < 1.
    """
    sine = np.asarray(sine, dtype=np.float64)
    _check_bounds("sine of the end's slope", sine, _SINES, "press less")
    # I = 1 + a and J = 2/3 (1 + b). The formulas in a and b do not subtract nearly equal numbers.
    a, b = _integrals(np.asarray(sine * sine))
    return Cantilever(
        force=2.0 * sine * (1.0 + a) ** 2,
        deflection=2.0 / 3.0 * sine * (1.0 + b) / (1.0 + a),
        stiffening=(3.0 * a + 3.0 * a * a + a**3 - b) / (1.0 + b),  # (1 + a)^3 / (1 + b) - 1
    )


def _check_bounds(name: str, values: Floats, bounds: Bounds, hint: str) -> None:
    """Raise InputError if any of the values [1] is out of bounds."""
    for value in (float(values.min()), float(values.max())):
        if not bounds.hold(value):
            raise validation_error(name, value, "1", str(bounds), hint)


def _integrals(square: Floats) -> tuple[Floats, Floats]:
    """Return a = I - 1 and b = 3/2 J - 1 [1] in the shape of `square` = s^2.

    I and J are the integrals of `cantilever`,

        I = int_0^1 dv / sqrt(1 - x),    J = int_0^1 (1 - v^2) dv / sqrt(1 - x),    x = s^2 (1 - v^2)^2.

    The binomial series of 1 / sqrt(1 - x) is integrated over v term by term. The first term of the series contributes 1
    to I and 2/3 to J. This term is left out, because subtracting it later would cancel the leading digits for small s.
    """
    a = b = np.zeros_like(square)
    coefficient = np.ones_like(square)
    odd_integral = 2.0 / 3.0  # integral of 1 - v^2
    for n in itertools.count(1):
        # coefficient of x^n in 1 / sqrt(1 - x), times s^(2 n)
        coefficient = coefficient * square * (2 * n - 1) / (2 * n)
        even_integral = odd_integral * 4 * n / (4 * n + 1)  # integral of (1 - v^2)^(2 n)
        odd_integral = even_integral * (4 * n + 2) / (4 * n + 3)  # integral of (1 - v^2)^(2 n + 1)
        a = a + coefficient * even_integral
        b = b + 1.5 * coefficient * odd_integral  # because 1 + b is 1.5 J
        # The terms decrease faster than a geometric series in s^2, which bounds the sum of the remaining terms.
        remainder_bound = coefficient * square / (1.0 - square)
        if (remainder_bound <= _ROUND_OFF * a).all():
            break
    return a, b


def large_deflection_stiffening(length: float, deflection: Floats | float) -> Floats:
    """Return the relative increase [1] of the secant stiffness of a guided leaf, or of a pair, due to its deflection.

    `length` L [mm] is the length of a leaf, and `deflection` d [mm] an array of any shape; the result has the same
    shape. The increase is relative to the stiffness at small deflections; for small d it is 36/35 (d / L)^2. The
    shuttle does not rotate, but it is free to move along the leaves. So each half of a leaf is a cantilever of length
    L / 2 and deflection d / 2. Raises InputError unless 0 <= d <= L / 2.
    """
    relative = np.asarray(deflection, dtype=np.float64) / length
    _check_bounds("deflection / leaf length", relative, _DEFLECTIONS, "use a longer leaf or press less")
    # The sine is found by fixed-point iteration. The deflection is nearly proportional to the sine: it is 2/3 of the
    # sine while both are small.
    sine = 1.5 * relative
    for _ in range(_MAX_STEPS):
        half_leaf = cantilever(sine)
        if (np.abs(half_leaf.deflection - relative) <= _CONVERGED * relative).all():
            break
        sine = sine * np.divide(
            relative, half_leaf.deflection, out=np.ones_like(sine), where=half_leaf.deflection > 0.0
        )
    return half_leaf.stiffening
