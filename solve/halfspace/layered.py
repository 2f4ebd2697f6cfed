"""A half-space under a bonded layer of another modulus: how its surface sinks under normal loads.

Under a pressure of wave number k the surface sinks by 2 (1 - nu_s^2) / (E_s k) T(k h) per unit, with T that of
D. M. Burmister, J. Appl. Phys. 16 (1945) 89, doi:10.1063/1.1707558, as K. L. Johnson, Contact Mechanics (1985), 5.8
and T. C. O'Sullivan, R. B. King, J. Tribol. 110 (1988) 235, doi:10.1115/1.3261591 have it: 1 for short waves, which
meet the layer alone. A point load therefore acts as on a half-space of the layer, and beside it by

    (1 - nu_s^2) / (pi E_s) l(r),    l(r) = int_0^inf (T(k h) - 1) J_0(k r) dk,

which is smooth. Moduli are over that of the half-space below.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.polynomial import legendre
from scipy.interpolate import CubicSpline
from scipy.special import j0

from solve.arrays import Floats

DEEPEST = 25.0  # k h beyond which T is 1 to rounding
POINTS = 12  # of Gauss's rule on a panel, which holds a period of the fastest wave
DISTANCES = 160  # of the table of l(r)


@dataclass(frozen=True)
class Layer:
    """A layer: thickness [mm], modulus over that of what lies below [1], Poisson's ratios of both [1]."""

    thickness: float
    modulus: float
    poisson: float
    poisson_below: float

    @property
    def surface(self) -> float:
        """Return (1 - nu_s^2) / E_s, with the modulus below as 1 [1]."""
        return (1.0 - self.poisson**2) / self.modulus

    def softening(self, kh: Floats) -> Floats:
        """Return T - 1 at wave numbers over 1 / thickness [1], each above 0."""
        shear = self.modulus * (1.0 + self.poisson_below) / (1.0 + self.poisson)
        below = 1.0 - 4.0 * (1.0 - self.poisson) / (1.0 + shear * (3.0 - 4.0 * self.poisson_below))
        above = (shear - 1.0) / (shear + 3.0 - 4.0 * self.poisson)
        decay = np.exp(-2.0 * kh)
        sinking = 1.0 + 4.0 * above * kh * decay - below * above * decay**2
        stiffness = 1.0 - (below + above + 4.0 * above * kh**2) * decay + below * above * decay**2
        return np.asarray(sinking / stiffness - 1.0)

    def smooth_compliance(self, deviations: Sequence[float], distance: float) -> float:
        """Return the displacement under one load by another, both of normal distribution, times E below [1/mm].

        `deviations` [mm] are theirs, each way; it is weighted with the density of the load that feels it.
        """
        width = math.hypot(*deviations)
        k, weight = _panels(9.0 / width, 2.0 * math.pi / max(distance, width))
        spectrum = np.exp(-0.5 * (width * k) ** 2) * j0(k * distance)
        return float(self.surface / math.pi * weight @ (spectrum * (1.0 + self.softening(k * self.thickness))))


def added_compliances(layers: Sequence[Layer], distances: Floats) -> Floats:
    """Return (1 - nu_s^2) / (pi E_s) l(r) at distances [mm] for layers of one thickness, shape (layers, ...) [1/mm]."""
    h = layers[0].thickness
    farthest = max(float(distances.max(initial=0.0)), h)
    table = h * np.sinh(np.linspace(0.0, math.asinh(farthest / h), DISTANCES))
    table[-1] = farthest
    k, weight = _panels(DEEPEST / h, 2.0 * math.pi / farthest)
    softening = np.array([layer.surface / math.pi * layer.softening(k * h) for layer in layers])
    added = (softening * weight) @ j0(np.outer(k, table))
    return np.asarray(CubicSpline(table, added, axis=1)(distances))


def _panels(end: float, longest: float) -> tuple[Floats, Floats]:
    """Return points and weights of Gauss's rule on panels from 0 to an end, none longer than `longest`."""
    point, weight = legendre.leggauss(POINTS)
    edges = np.linspace(0.0, end, math.ceil(end / longest) + 4)
    half = 0.5 * np.diff(edges)
    middle = 0.5 * (edges[1:] + edges[:-1])
    return (middle[:, None] + half[:, None] * point).ravel(), (half[:, None] * weight).ravel()
