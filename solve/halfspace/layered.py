"""A half-space under a bonded layer of another modulus: how its surface sinks under normal loads.

Under a pressure of wave number k the surface sinks by 2 (1 - nu_s^2) / (E_s k) T(k h) per unit. T is that of D. M.
Burmister, J. Appl. Phys. 16 (1945) 89, doi:10.1063/1.1707558, as K. L. Johnson, Contact Mechanics (1985), 5.8 and T. C.
O'Sullivan, R. B. King, J. Tribol. 110 (1988) 235, doi:10.1115/1.3261591 have it. T is 1 for short waves, which meet the
layer alone. A point load therefore acts as on a half-space of the layer, and beside it by

    (1 - nu_s^2) / (pi E_s) l(r),    l(r) = int_0^inf (T(k h) - 1) J_0(k r) dk,

which is smooth. Moduli are divided by that of the half-space below.
"""

import functools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.polynomial import legendre
from scipy.special import j0

from sensor.arrays import Floats

DEEPEST = 25.0  # k h beyond which T is 1 to rounding
POINTS = 12  # of Gauss's rule on a panel, which holds a period of the fastest wave
SHORTEST = 30.0  # k a beyond which a layer bears next to nothing as a shell: 1e-4 of it
NEXT_TO_RIGID = 1e-7  # modulus of a layer over that of its base
DISTANCES = 160  # of the table of l(r)
EQUATIONS = 40  # at points of a radius
RADII = 48
LEAST_RADIUS = 0.01  # of the thickness: there the layer is all that is felt


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
        """Return T - 1 [1] of the module's first lines at wave numbers times thickness k h > 0 [1], of their shape."""
        shear = self.modulus * (1.0 + self.poisson_below) / (1.0 + self.poisson)
        below = 1.0 - 4.0 * (1.0 - self.poisson) / (1.0 + shear * (3.0 - 4.0 * self.poisson_below))
        above = (shear - 1.0) / (shear + 3.0 - 4.0 * self.poisson)
        decay = np.exp(-2.0 * kh)
        sinking = 1.0 + 4.0 * above * kh * decay - below * above * decay**2
        stiffness = 1.0 - (below + above + 4.0 * above * kh**2) * decay + below * above * decay**2
        return np.asarray(sinking / stiffness - 1.0)

    def smooth_compliance(self, deviations: Sequence[float], distance: float) -> float:
        """Return the displacement under one smooth load by another, times E below [1/mm].

        Both are normal distributions with standard deviations `deviations` [mm], their centres a distance [mm] apart.
        The displacement is weighted with the density of the load that feels it.
        """
        width = math.hypot(*deviations)
        k, weight = _panels(9.0 / width, 2.0 * math.pi / max(distance, width))
        spectrum = np.exp(-0.5 * (width * k) ** 2) * j0(k * distance)
        return float(self.surface / math.pi * weight @ (spectrum * (1.0 + self.softening(k * self.thickness))))

    def shell_effect(self, radius: float, deviation: float, curvatures: Sequence[float]) -> float:
        """Return the compliance that a curved layer loses as a shallow shell, times E below [1/mm].

        It is that under a flat circle of a radius [mm], less that under a normal distribution of a standard deviation
        [mm]. `curvatures` [1/mm] are the two principal ones. A shell is stiffer normal to it by (E_s - E) h (kappa_y
        k_x^2 + kappa_x k_y^2)^2 / k^4, here its mean over all directions of the wave vector. See E. Reissner, J. Math.
        Phys. 25 (1946) 80, doi:10.1002/sapm194625180. The energy is of first order in it.
        """
        along, across = curvatures
        shell = (self.modulus - 1.0) * self.thickness * (3.0 * along**2 + 3.0 * across**2 + 2.0 * along * across) / 8.0
        k, weight = _panels(SHORTEST / radius, 2.0 * math.pi / max(radius, deviation))
        sinking = 2.0 * self.surface / k * (1.0 + self.softening(k * self.thickness))
        # Squares of the transforms of both pressures: of the circle, less of the normal distribution.
        spectrum = (np.sin(k * radius) / (k * radius)) ** 2 - np.exp(-((deviation * k) ** 2))
        return shell * float(weight @ (k * sinking**2 * spectrum)) / (2.0 * math.pi)


def added_compliances(layers: Sequence[Layer], distances: Floats) -> Floats:
    """Return the compliance that the half-space below layers adds at distances [mm], times E below [1/mm].

    It is (1 - nu_s^2) / (pi E_s) l(r) of the module's first lines, shape (layers, ...). All layers have one thickness.
    Any number of distances are interpolated in a table of some.
    """
    h = layers[0].thickness
    farthest = max(float(distances.max(initial=0.0)), h)
    table = h * np.sinh(np.linspace(0.0, math.asinh(farthest / h), DISTANCES))
    table[-1] = farthest
    return np.asarray(_spline(table, _added_at(layers, table), axis=1)(distances))


def _added_at(layers: Sequence[Layer], distances: Floats) -> Floats:
    """Return `added_compliances` at distances (n,) [mm] without a table, shape (layers, n).

    Each distance takes an integral of its own, so this is for few of them.
    """
    h = layers[0].thickness
    k, weight = _panels(DEEPEST / h, 2.0 * math.pi / max(float(distances.max(initial=0.0)), h))
    softening = np.array([layer.surface / math.pi * layer.softening(k * h) for layer in layers])
    return np.asarray((softening * weight) @ j0(np.outer(k, distances)))


def base_compliance(thickness: float, poisson: float, distances: Floats) -> Floats:
    """Return the change of the half-space's compliance by a rigid base under a layer [mm], times E [1/mm].

    It is negative, at a few distances between point loads [mm], of their shape.
    """
    layer = Layer(thickness=thickness, modulus=NEXT_TO_RIGID, poisson=poisson, poisson_below=poisson)
    return NEXT_TO_RIGID * _added_at([layer], distances.ravel()).reshape(distances.shape)


@dataclass(frozen=True, eq=False)
class RoundContact:
    """Rigid round bodies on a layered half-space, at contact radii [mm], shape (n,), rising, each as these.

    `depth` is the depth times the radius of curvature of a paraboloid [mm^2], `force` its force times that over the
    modulus below [mm^3]. `stiffness` is that of the flat circle over it [mm], which is also d force / d depth.
    """

    radius: Floats
    depth: Floats
    force: Floats
    stiffness: Floats

    def flat_stiffness(self, radius: float) -> float:
        """Return the stiffness of a flat circle [mm]."""
        return float(_between(self.radius, self.stiffness, np.array(radius), 1.0))

    def press(self, depth: Floats) -> tuple[Floats, Floats, Floats]:
        """Return radius, force and stiffness of contacts at depths times their radii of curvature [mm^2]."""
        radius = _between(self.depth, self.radius, depth, 0.5)
        force = _between(self.radius, self.force, radius, 3.0)
        return radius, force, _between(self.radius, self.stiffness, radius, 1.0)


@functools.lru_cache(maxsize=64)
def round_contact(layer: Layer, largest: float) -> RoundContact:
    """Return the contacts of rigid round bodies with a layered half-space, up to a contact radius [mm].

    For each contact radius a, the integral equation of N. N. Lebedev and Y. S. Ufliand,

        phi(t) + int_0^a M(t, s) phi(s) ds = (d - t^2 / R) / (pi (1 - nu_s^2) / E_s),

    M(t, s) = 2 / pi int_0^inf (T(k h) - 1) cos k t cos k s dk, is solved at Gauss's points; the force is
    2 pi int_0^a phi: J. Appl. Math. Mech. 22 (1958) 442, doi:10.1016/0021-8928(58)90063-5. A paraboloid touches as far
    as phi(a) = 0.
    """
    h = layer.thickness
    # int (T - 1) cos(k t) dk over t: M is the sum of it at |t - s| and at t + s, over pi.
    table = h * np.sinh(np.linspace(0.0, math.asinh(2.0 * largest / h), DISTANCES))
    k, weight = _panels(DEEPEST / h, math.pi / largest)
    waves = _spline(table, np.cos(np.outer(table, k)) @ (weight * layer.softening(k * h)))
    gauss_points, gauss_weights = legendre.leggauss(EQUATIONS)
    radii = np.geomspace(LEAST_RADIUS * min(h, largest), largest, RADII)
    rows = []
    for a in radii:
        t = 0.5 * a * (1.0 + np.append(gauss_points, 1.0))  # the last at the edge
        s = t[:-1]
        weights = 0.5 * a * gauss_weights
        kernel = (waves(np.abs(t[:, None] - s)) + waves(t[:, None] + s)) / math.pi * weights
        # Right-hand sides of d = 1 alone and of 1 / R = 1 alone, with the sign of the latter turned.
        right = np.stack([np.ones(len(t)), t**2], axis=1) / (math.pi * layer.surface)
        phi = np.linalg.solve(np.eye(len(s)) + kernel[:-1], right[:-1])
        # The depth of a paraboloid of R = 1 makes phi(a) = 0.
        flat_at_edge, parabola_at_edge = right[-1] - kernel[-1] @ phi
        depth = parabola_at_edge / flat_at_edge
        stiffness, parabola_force = 2.0 * math.pi * weights @ phi
        rows.append((depth, depth * stiffness - parabola_force, stiffness))
    return RoundContact(radii, *np.array(rows).T)


def _spline(x: Floats, y: Floats, axis: int = 0) -> Callable[[Floats], Floats]:
    """Return the cubic spline through y at x, along an axis of y."""
    from scipy.interpolate import CubicSpline  # seldom needed, and slow to load

    spline: Callable[[Floats], Floats] = CubicSpline(x, y, axis=axis)
    return spline


def _between(x: Floats, y: Floats, at: Floats, power: float) -> Floats:
    """Return y at points of at least 0 by a cubic spline over logarithms; below the table it is a power of x."""
    inside = np.clip(at, x[0], x[-1])
    found = np.exp(_spline(np.log(x), np.log(y))(np.log(inside)))
    return np.asarray(found * (at / inside) ** power)


def _panels(end: float, longest: float) -> tuple[Floats, Floats]:
    """Return points and weights of Gauss's rule on panels from 0 to an end, none longer than `longest`."""
    point, weight = legendre.leggauss(POINTS)
    edges = np.linspace(0.0, end, math.ceil(end / longest) + 4)
    half = 0.5 * np.diff(edges)
    middle = 0.5 * (edges[1:] + edges[:-1])
    return (middle[:, None] + half[:, None] * point).ravel(), (half[:, None] * weight).ravel()
