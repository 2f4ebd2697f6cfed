"""The two bodies in a press: a sensor with domes on springs, and an ellipsoidal fruit.

The fruit may deviate from a smooth, homogeneous ellipsoid in four ways:

- A height map may be added to the skin. A form error may be added to the domes in the same way.
- The flesh may have a bonded outer layer, or may be bonded to a rigid stone. Both cases are treated exactly: the kernel
  1 / r is replaced by the kernel that follows from Burmister's transform.
- The flesh may be softer within a hemisphere under a dome, as in a bruise. The dome then has the compliance of the
  softer flesh, corrected by `BRUISE_CONSTANT` / radius because the flesh outside the hemisphere is stiffer. The
  compliance between domes is not affected. The contact is assumed to be small compared with the hemisphere.
- The flesh may yield. Its pressure is then limited to the yield pressure.

Lengths are in mm, forces in N, moduli in MPa. E* is E / (1 - nu^2).
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from typing import ClassVar

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.special import j0

from sensor.arrays import Floats

BRUISE_CONSTANT = (1.52, 2.3)
"""Deflection of a point per unit force due to the flesh outside a hemisphere around it, times the radius and pi E* [1].

The first number is the value at a Poisson's ratio of 0.3. The second is its derivative with respect to Poisson's ratio.
Both were computed by finite elements and are accurate to 3 % (`tests/solve/presses`).
"""


@dataclass(frozen=True, kw_only=True)
class SprungDomes:
    """Spherical domes at `positions` (tips, 2) [mm], each on a spring of stiffness `K` (tips,) [N/mm].

    `form` is the form error: it maps the distance from the axis of a dome [mm] to the protrusion of the surface beyond
    the ideal sphere [mm]. The domes end at the distance `rim` [mm] from their axes.
    """

    dome_radius: float
    positions: np.ndarray
    K: np.ndarray
    form: Callable[[Floats], Floats] | None = None
    rim: float = math.inf


@dataclass(frozen=True)
class OuterLayer:
    """An outer layer that is bonded to the flesh below it.

    `stiffness` [1] is the modulus of the layer divided by the modulus of the flesh below. The `thickness` [mm] must be
    larger than the cells of the grids. See D. M. Burmister, J. Appl. Phys. 16 (1945) 89; T. C. O'Sullivan, R. B. King,
    J. Tribol. 110 (1988) 235.
    """

    thickness: float
    stiffness: float
    poisson: float = 0.3

    def compliance(self, t: Floats) -> Floats:
        """Return the compliance divided by the compliance of a half-space of the layer's material [1].

        `t` [1] is the wave number of the pressure times the thickness.
        """
        return _burmister(t, self.stiffness, self.poisson)

    @cached_property
    def base_effect(self) -> CubicSpline:
        """Return the change in deflection due to the flesh below the layer, as a function of distance [mm].

        The change is the deflection per unit force, times pi E* of the flesh below, minus 1 / (stiffness r) [1/mm].
        """
        return _base_effect(self.compliance, self.thickness, self.stiffness)


@dataclass(frozen=True)
class FleshOnStone:
    """Flesh of the given `thickness` [mm], bonded to a rigid stone.

    `stiffness` [1] is the modulus of the layer divided by the modulus of the fruit. This ratio is 1, because the layer
    is the flesh itself. See K. L. Johnson, Contact Mechanics (1985), section 5.8.
    """

    thickness: float
    poisson: float = 0.3
    stiffness: ClassVar[float] = 1.0

    def compliance(self, t: Floats) -> Floats:
        """Return the compliance divided by the compliance of flesh without a stone [1].

        `t` [1] is the wave number of the pressure times the thickness.
        """
        return _burmister(t, 0.0, self.poisson)  # a stiffness ratio of 0 means a rigid base

    @cached_property
    def base_effect(self) -> CubicSpline:
        """Return the change in deflection due to the stone, as a function of distance [mm].

        The change is the deflection per unit force, times pi E*, minus 1 / r [1/mm].
        """
        return _base_effect(self.compliance, self.thickness, self.stiffness)


def _burmister(t: Floats, stiffness: float, poisson: float) -> Floats:
    """Return Burmister's transform of a layer on a base [1], as a function of the wave number of the pressure.

    The transform is the compliance of the layer on its base, divided by the compliance of a half-space of the layer's
    material. With the argument t, the wave number times the thickness of the layer [1], the transform is

        (1 + 4 b t exp(-2 t) - a b exp(-4 t)) / (1 - (a + b + 4 b t^2) exp(-2 t) + a b exp(-4 t)),

    where b = (s - 1) / (s + k), a = k (s - 1) / (1 + k s) and k = 3 - 4 nu. Here s is the argument `stiffness`, the
    modulus of the layer divided by the modulus of the base. For a rigid base, s is 0. Layer and base have the same
    Poisson's ratio nu.
    """
    k = 3.0 - 4.0 * poisson
    b = (stiffness - 1.0) / (stiffness + k)
    a = k * (stiffness - 1.0) / (1.0 + stiffness * k)
    decay = np.exp(-2.0 * t)
    decay_squared = np.exp(-4.0 * t)
    numerator = 1.0 + 4.0 * t * b * decay - a * b * decay_squared
    return numerator / (1.0 - (a + b + 4.0 * b * t**2) * decay + a * b * decay_squared)


def _base_effect(compliance: Callable[[Floats], Floats], thickness: float, stiffness: float) -> CubicSpline:
    """Return the change in deflection due to a base below a layer, as a spline in the distance r from the load [mm].

    The change is the deflection per unit force times pi E* [1/mm]. For a layer of `thickness` h [mm] and relative
    `stiffness` s [1], it is the inverse Hankel transform

        1 / (s h) int_0^inf (T(t) - 1) J_0(t r / h) dt,

    where T is the function `compliance`.
    """
    t = np.linspace(0.0, 15.0, 3001)  # T - 1 decays like t^2 exp(-2 t), so the integral may end at 15
    r = thickness * np.concatenate([np.linspace(0.0, 4.0, 81), np.geomspace(4.0, 40.0, 60)[1:]])
    integrand = (compliance(t) - 1.0) * j0(t * r[:, None] / thickness)
    return CubicSpline(r, np.asarray(np.trapezoid(integrand, t, axis=-1)) / (stiffness * thickness))


@dataclass(frozen=True, kw_only=True)
class EllipsoidFruit:
    """An ellipsoidal fruit in the frame of the sensor, with optional unevenness, soft spots, layer and yield pressure.

    `E` [MPa] and `poisson` are the elastic constants. `R1` and `R2` [mm] are the principal radii of curvature at the
    apex. `R1` is the radius in the direction `azimuth` [deg] from +x. The apex of the fruit lies at `apex` [mm]. The
    sensor is tilted by `tilt` [deg], so that its side in the direction `tilt_azimuth` [deg] is lower. `heights` (tips,)
    [mm] are the protrusions of the domes.

    `bumps` maps x, y [mm] to the height added to the skin [mm]. Under each dome, within a hemisphere of radius
    `soft_radius` (tips,) [mm], the flesh is `softness` (tips,) [1] times as compliant as elsewhere. Flesh yields at the
    pressure `yields` [MPa].
    """

    E: float
    R1: float
    R2: float
    azimuth: float = 0.0
    tilt: float = 0.0
    tilt_azimuth: float = 0.0
    apex: tuple[float, float] = (0.0, 0.0)
    poisson: float = 0.3
    heights: tuple[float, ...] = field(default=(0.0,))
    bumps: Callable[[Floats, Floats], Floats] | None = None
    softness: tuple[float, ...] = (1.0,)
    soft_radius: tuple[float, ...] = (math.inf,)
    layer: OuterLayer | FleshOnStone | None = None
    yields: float = math.inf

    @property
    def local_compliance(self) -> Floats:
        """Return the effect of soft flesh under each dome as a factor and a constant, shape (2, tips).

        The factor is the compliance of the soft flesh divided by the compliance of the flesh elsewhere [1]. The
        constant is added to the deflection per unit force times pi E* [1/mm].
        """
        softness, radius = np.broadcast_arrays(self.softness, self.soft_radius)
        constant = BRUISE_CONSTANT[0] + BRUISE_CONSTANT[1] * (self.poisson - 0.3)
        return np.stack([softness, (1.0 - softness) * constant / radius])

    @property
    def curvature(self) -> Floats:
        """Return the curvature tensor of the skin at the apex, along x and y [1/mm], shape (2, 2)."""
        angle = math.radians(self.azimuth)
        along = np.array([math.cos(angle), math.sin(angle)])
        across = np.array([-along[1], along[0]])
        return np.outer(along, along) / self.R1 + np.outer(across, across) / self.R2

    @property
    def slope(self) -> Floats:
        """Return the slope of the skin at the apex along x and y [1], shape (2,), in the frame of the sensor."""
        angle = math.radians(self.tilt_azimuth)
        return math.tan(math.radians(self.tilt)) * np.array([math.cos(angle), math.sin(angle)])

    @property
    def compliance(self) -> float:
        """Return (1 - nu^2) / (pi E) [mm^2/N]: the deflection due to a unit point load, times the distance from it."""
        return (1.0 - self.poisson**2) / (math.pi * self.E)
