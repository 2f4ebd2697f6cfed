"""An elastic half-space with a bonded layer of another modulus: the surface displacement under normal loads.

Under a pressure of wave number k, the surface displacement per unit pressure is 2 (1 - nu_s^2) / (E_s k) T(k h). T is
given by D. M. Burmister, J. Appl. Phys. 16 (1945) 89, doi:10.1063/1.1707558, in the form of K. L. Johnson, Contact
Mechanics (1985), 5.8 and T. C. O'Sullivan, R. B. King, J. Tribol. 110 (1988) 235, doi:10.1115/1.3261591. T tends to 1
for short waves, because they deform only the layer. The compliance under a point load is therefore the compliance of a
half-space of the layer's material, plus the smooth term

    (1 - nu_s^2) / (pi E_s) l(r),    l(r) = int_0^inf (T(k h) - 1) J_0(k r) dk.

Here nu_s and E_s are the elastic constants of the layer, h is its thickness and r the distance from the load. Moduli
are relative to the modulus of the half-space below the layer.
"""

import functools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.polynomial import legendre
from scipy.special import j0

from sensor.arrays import Floats

LARGEST_KH = 25.0  # largest k h in integrals; above it T is 1 to machine precision
PANEL_POINTS = 12  # Gauss points per panel; a panel is at most as long as a period of the fastest oscillation
LARGEST_KA = 30.0  # largest k a in the integral of the shell effect; shorter waves contribute 1e-4 of the effect
NEARLY_RIGID = 1e-7  # modulus of a layer relative to a base that is practically rigid
TABLE_DISTANCES = 160  # number of distances in the table of l(r)
RADIAL_POINTS = 40  # Gauss points of the integral equation along a radius
TABLE_RADII = 48  # number of contact radii in the table of a round contact
SMALLEST_RADIUS = 0.01  # smallest contact radius in the table divided by the thickness; there only the layer deforms


@dataclass(frozen=True)
class Layer:
    """A layer of the given `thickness` [mm] bonded to a half-space.

    `modulus` [1] is the modulus of the layer divided by the modulus of the half-space. `poisson` and `poisson_below`
    are the Poisson's ratios of the layer and of the half-space.
    """

    thickness: float
    modulus: float
    poisson: float
    poisson_below: float

    @property
    def surface(self) -> float:
        """Return (1 - nu_s^2) / E_s [1], relative to a half-space of modulus 1."""
        return (1.0 - self.poisson**2) / self.modulus

    def softening(self, kh: Floats) -> Floats:
        """Return T - 1 [1], the relative change in compliance due to the half-space below the layer.

        The argument t of Burmister's function T is `kh` > 0 [1], the wave number times the thickness, an array of any
        shape. With the shear modulus m of the layer, divided by the shear modulus of the half-space,

            T = (1 + 4 b t exp(-2 t) - a b exp(-4 t)) / (1 - (a + b + 4 b t^2) exp(-2 t) + a b exp(-4 t)),

        where a = 1 - 4 (1 - nu_s) / (1 + m (3 - 4 nu)), b = (m - 1) / (m + 3 - 4 nu_s), and nu is Poisson's ratio of
        the half-space. See K. L. Johnson, Contact Mechanics (1985), section 5.8.
        """
        shear_ratio = self.modulus * (1.0 + self.poisson_below) / (1.0 + self.poisson)
        a = 1.0 - 4.0 * (1.0 - self.poisson) / (1.0 + shear_ratio * (3.0 - 4.0 * self.poisson_below))
        b = (shear_ratio - 1.0) / (shear_ratio + 3.0 - 4.0 * self.poisson)
        decay = np.exp(-2.0 * kh)
        numerator = 1.0 + 4.0 * b * kh * decay - a * b * decay**2
        denominator = 1.0 - (a + b + 4.0 * b * kh**2) * decay + a * b * decay**2
        return np.asarray(numerator / denominator - 1.0)

    def smooth_compliance(self, deviations: Sequence[float], distance: float) -> float:
        """Return the mean displacement under one smooth load per unit force of another, times the modulus below [1/mm].

        The pressures are normal distributions with the standard deviations `deviations` [mm], and `distance` [mm] is
        the distance between their centres. The mean displacement is weighted by the pressure of the first load. In the
        integral over all wave numbers k [1/mm], the two distributions act like one whose variance is the sum of theirs.
        """
        width = math.hypot(*deviations)
        # The integral ends at k = 9 / width, where the spectrum has decayed to exp(-40.5).
        k, weight = _panels(9.0 / width, 2.0 * math.pi / max(distance, width))
        spectrum = np.exp(-0.5 * (width * k) ** 2) * j0(k * distance)
        return float(self.surface / math.pi * weight @ (spectrum * (1.0 + self.softening(k * self.thickness))))

    def shell_effect(self, radius: float, deviation: float, curvatures: Sequence[float]) -> float:
        """Return the decrease in compliance due to the shell stiffness of a curved layer, times the modulus below.

        The result [1/mm] is the decrease under a flat circular punch of `radius` [mm], minus the decrease under a
        normally distributed pressure of standard deviation `deviation` [mm]. `curvatures` [1/mm] are the two principal
        curvatures kappa_x and kappa_y of the layer.

        Let E_s be the modulus of the layer, h its thickness, and E the modulus below. At the wave vector (k_x, k_y), a
        shallow shell has the additional normal stiffness per area (E_s - E) h (kappa_y k_x^2 + kappa_x k_y^2)^2 / k^4.
        It is averaged over all directions of the wave vector. Its effect on the compliance is computed to first order.
        See E. Reissner, J. Math. Phys. 25 (1946) 80, doi:10.1002/sapm194625180.
        """
        kappa_x, kappa_y = curvatures
        # The mean of (kappa_y k_x^2 + kappa_x k_y^2)^2 / k^4 over all directions is `squares` / 8.
        squares = 3.0 * kappa_x**2 + 3.0 * kappa_y**2 + 2.0 * kappa_x * kappa_y
        shell_stiffness = (self.modulus - 1.0) * self.thickness * squares / 8.0
        k, weight = _panels(LARGEST_KA / radius, 2.0 * math.pi / max(radius, deviation))  # wave numbers [1/mm]
        # Surface displacement per unit pressure of wave number k, times the modulus below [mm].
        compliance = 2.0 * self.surface / k * (1.0 + self.softening(k * self.thickness))
        # Squared Fourier transforms of the two pressures: the circular punch minus the normal distribution.
        spectrum = (np.sin(k * radius) / (k * radius)) ** 2 - np.exp(-((deviation * k) ** 2))
        # To first order, a stiffness s in parallel reduces a compliance c by s c^2 at each wave number.
        return shell_stiffness * float(weight @ (k * compliance**2 * spectrum)) / (2.0 * math.pi)


def added_compliances(layers: Sequence[Layer], distances: Floats) -> Floats:
    """Return the change in compliance due to the half-space below each layer, times the modulus below [1/mm].

    The change is (1 - nu_s^2) / (pi E_s) int_0^inf (T(k h) - 1) J_0(k r) dk, relative to a half-space of the layer's
    material. `distances` r [mm] between load and displacement may have any shape (...), and the result has the shape
    (layers, ...). All layers must have the same thickness h. The values are interpolated in a table, so that many
    distances cost little.
    """
    h = layers[0].thickness
    largest = max(float(distances.max(initial=0.0)), h)
    # The hyperbolic sine gives equal steps up to about the thickness, and equal ratios beyond.
    table_distances = h * np.sinh(np.linspace(0.0, math.asinh(largest / h), TABLE_DISTANCES))
    table_distances[-1] = largest  # removes round-off, so that no distance is outside the table
    return np.asarray(_spline(table_distances, _added_at(layers, table_distances), axis=1)(distances))


def _added_at(layers: Sequence[Layer], distances: Floats) -> Floats:
    """Return `added_compliances` at distances (n,) [mm] by direct integration, shape (layers, n).

    All layers must have the same thickness. The cost is one integral per distance and layer.
    """
    h = layers[0].thickness
    largest = max(float(distances.max(initial=0.0)), h)
    k, weight = _panels(LARGEST_KH / h, 2.0 * math.pi / largest)  # wave numbers [1/mm] and their quadrature weights
    softening = np.array([layer.surface / math.pi * layer.softening(k * h) for layer in layers])
    return np.asarray((softening * weight) @ j0(np.outer(k, distances)))


def base_compliance(thickness: float, poisson: float, distances: Floats) -> Floats:
    """Return the change in the compliance of a half-space due to a rigid base, times E [1/mm].

    The base lies at the depth `thickness` [mm]. The change is negative and has the shape of `distances` [mm], the
    distances between load and displacement. The cost is one integral per distance.
    """
    layer = Layer(thickness=thickness, modulus=NEARLY_RIGID, poisson=poisson, poisson_below=poisson)
    return NEARLY_RIGID * _added_at([layer], distances.ravel()).reshape(distances.shape)


@dataclass(frozen=True, eq=False)
class RoundContact:
    """A table of rigid axisymmetric punches on a layered half-space, at increasing contact radii; all arrays are (n,).

    `radius` [mm] is the contact radius. `depth` [mm^2] is the indentation of a paraboloid times its radius of
    curvature. `force` [mm^3] is the force on the paraboloid times its radius of curvature, divided by the modulus
    below. `stiffness` [mm] is the stiffness of a flat circular punch divided by the modulus below. It is also equal to
    d force / d depth.
    """

    radius: Floats
    depth: Floats
    force: Floats
    stiffness: Floats

    def flat_stiffness(self, radius: float) -> float:
        """Return the stiffness of a flat circular punch of this `radius` [mm], divided by the modulus below [mm]."""
        return float(_interpolate(self.radius, self.stiffness, np.array(radius), 1.0))

    def press(self, depth: Floats) -> tuple[Floats, Floats, Floats]:
        """Return the contact radius, force and stiffness of paraboloids at given depths, in the units of the table.

        `depth` [mm^2] is the indentation times the radius of curvature.
        """
        # Contacts smaller than the smallest one in the table follow the power laws of Hertz.
        radius = _interpolate(self.depth, self.radius, depth, 0.5)
        force = _interpolate(self.radius, self.force, radius, 3.0)
        return radius, force, _interpolate(self.radius, self.stiffness, radius, 1.0)


@functools.lru_cache(maxsize=64)
def round_contact(layer: Layer, largest: float) -> RoundContact:
    """Return the table of axisymmetric punches on the layered half-space `layer`, up to the radius `largest` [mm].

    For each contact radius a, the integral equation of N. N. Lebedev and Y. S. Ufliand,

        phi(t) + int_0^a M(t, s) phi(s) ds = (d - t^2 / R) / (pi (1 - nu_s^2) / E_s),

    is solved at Gauss points, where M(t, s) = 2 / pi int_0^inf (T(k h) - 1) cos k t cos k s dk. Here d is the
    indentation and R the radius of curvature. The force is 2 pi int_0^a phi. For a paraboloid, the condition phi(a) = 0
    determines d. See J. Appl. Math. Mech. 22 (1958) 442, doi:10.1016/0021-8928(58)90063-5.
    """
    cosine_transform = _softening_transform(layer, largest)
    radii = np.geomspace(SMALLEST_RADIUS * min(layer.thickness, largest), largest, TABLE_RADII)
    gauss_rule = legendre.leggauss(RADIAL_POINTS)
    punches = [_solve_punch(a, layer, cosine_transform, gauss_rule) for a in radii]
    depths, forces, stiffnesses = np.array(punches).T
    return RoundContact(radius=radii, depth=depths, force=forces, stiffness=stiffnesses)


def _softening_transform(layer: Layer, largest: float) -> Callable[[Floats], Floats]:
    """Return the function c(t) = int_0^inf (T(k h) - 1) cos(k t) dk [1/mm], as a spline.

    It is tabulated up to t = 2 `largest` [mm], the largest sum of two radii in a contact.
    """
    h = layer.thickness
    # The hyperbolic sine gives equal steps up to about the thickness, and equal ratios beyond.
    table_distances = h * np.sinh(np.linspace(0.0, math.asinh(2.0 * largest / h), TABLE_DISTANCES))
    k, weight = _panels(LARGEST_KH / h, math.pi / largest)  # wave numbers [1/mm] and their quadrature weights
    return _spline(table_distances, np.cos(np.outer(table_distances, k)) @ (weight * layer.softening(k * h)))


def _solve_punch(
    a: float, layer: Layer, cosine_transform: Callable[[Floats], Floats], gauss_rule: tuple[Floats, Floats]
) -> tuple[float, float, float]:
    """Return the depth, force and stiffness of a punch with the contact radius a [mm], in the units of `RoundContact`.

    The docstring of `round_contact` states the integral equation. A product of two cosines is half the sum of the
    cosines of their sum and difference. The kernel M(t, s) is therefore (c(|t - s|) + c(t + s)) / pi, where c is
    `cosine_transform`. `gauss_rule` holds the points and the weights of Gauss quadrature from -1 to 1.
    """
    gauss_points, gauss_weights = gauss_rule
    t = 0.5 * a * (1.0 + np.append(gauss_points, 1.0))  # the last point is at the edge of the contact
    s = t[:-1]
    weights = 0.5 * a * gauss_weights
    kernel = (cosine_transform(np.abs(t[:, None] - s)) + cosine_transform(t[:, None] + s)) / math.pi * weights
    # The equation is linear, so it is solved for two right-hand sides: a flat punch with d = 1, and t^2 for 1 / R = 1.
    right_sides = np.stack([np.ones(len(t)), t**2], axis=1) / (math.pi * layer.surface)
    phi = np.linalg.solve(np.eye(len(s)) + kernel[:-1], right_sides[:-1])
    # A paraboloid with R = 1 has the solution d phi_flat - phi_parabola, which must vanish at the edge.
    flat_at_edge, parabola_at_edge = right_sides[-1] - kernel[-1] @ phi
    depth = parabola_at_edge / flat_at_edge
    stiffness, parabola_force = 2.0 * math.pi * weights @ phi
    return depth, depth * stiffness - parabola_force, stiffness


def _spline(x: Floats, y: Floats, axis: int = 0) -> Callable[[Floats], Floats]:
    """Return the cubic spline through the values y at the points x, which run along `axis` of y."""
    from scipy.interpolate import CubicSpline  # slow to load, and rarely needed

    spline: Callable[[Floats], Floats] = CubicSpline(x, y, axis=axis)
    return spline


def _interpolate(x: Floats, y: Floats, points: Floats, power: float) -> Floats:
    """Return y at points >= 0 by a cubic spline of ln y as a function of ln x, through the table x, y (n,).

    Outside the table, y is extrapolated in proportion to x ** power.
    """
    clipped = np.clip(points, x[0], x[-1])
    log_spline = _spline(np.log(x), np.log(y))
    values = np.exp(log_spline(np.log(clipped)))
    return np.asarray(values * (points / clipped) ** power)


def _panels(end: float, longest: float) -> tuple[Floats, Floats]:
    """Return the points and weights of Gauss quadrature on equal panels from 0 to `end`, none longer than `longest`."""
    point, weight = legendre.leggauss(PANEL_POINTS)
    panels = math.ceil(end / longest) + 3  # the addition gives at least four panels
    edges = np.linspace(0.0, end, panels + 1)
    half = 0.5 * np.diff(edges)
    middle = 0.5 * (edges[1:] + edges[:-1])
    return (middle[:, None] + half[:, None] * point).ravel(), (half[:, None] * weight).ravel()
