"""The sensor and the fruit of a press: domes on springs, and an ellipsoid that may be uneven, bruised or layered.

**Deviations from a smooth, homogeneous ellipsoid.** A height map may be added to the skin, and a form to the domes. An
outer layer bonded to the flesh is treated exactly: Burmister's transform of its compliance replaces 1 / r. So is flesh
on a rigid stone. Flesh may be softer within a hemisphere under a dome. The compliance of this dome is then that of the
softer flesh, minus a constant `BRUISE` / radius because the flesh outside is stiffer. The compliance between domes is
that of the flesh outside. The contact is assumed to be small compared with the hemisphere. Flesh that yields carries at
most its yield pressure.

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

BRUISE = (1.52, 2.3)
"""Deflection of a point per force due to the flesh outside a hemisphere around it, times the radius and pi E* [1].

The first number is the value at a Poisson's ratio of 0.3, the second its derivative by Poisson's ratio. Both are from
finite elements, within 3 % (`tests/solve/presses`).
"""


@dataclass(frozen=True, kw_only=True)
class SprungDomes:
    """Spherical domes at `positions` (tips, 2) [mm], each on a spring of stiffness `K` (tips,) [N/mm].

    `form` returns the height of the domes above the ideal spheres [mm] at distances from their axes [mm]. The domes end
    at the distance `rim` [mm] from their axes.
    """

    dome_radius: float
    positions: np.ndarray
    K: np.ndarray
    form: Callable[[Floats], Floats] | None = None
    rim: float = math.inf


@dataclass(frozen=True)
class OuterLayer:
    """An outer layer of flesh that is bonded to the flesh below, and `stiffness` [1] times as stiff.

    The `thickness` [mm] must be larger than the cells of the grids. See D. M. Burmister, J. Appl. Phys. 16 (1945) 89;
    T. C. O'Sullivan, R. B. King, J. Tribol. 110 (1988) 235.
    """

    thickness: float
    stiffness: float
    poisson: float = 0.3

    def compliance(self, t: Floats) -> Floats:
        """Return the compliance over the compliance of a half-space of the layer's material [1].

        `t` [1] is the wave number of the pressure times the thickness.
        """
        return _burmister(t, self.stiffness, self.poisson)

    @cached_property
    def base_effect(self) -> CubicSpline:
        """Return, as a function of distance [mm], the change in deflection due to the flesh below the layer.

        It is the deflection per force, times pi E* of the flesh below, minus 1 / (stiffness r) [1/mm].
        """
        return _base_effect(self.compliance, self.thickness, self.stiffness)


@dataclass(frozen=True)
class FleshOnStone:
    """Flesh of a `thickness` [mm] that is bonded to a rigid stone; see K. L. Johnson, Contact Mechanics (1985), 5.8.

    `stiffness` is the modulus of the layer over the modulus of the fruit [1]: 1, because the layer is the flesh.
    """

    thickness: float
    poisson: float = 0.3
    stiffness: ClassVar[float] = 1.0

    def compliance(self, t: Floats) -> Floats:
        """Return the compliance over the compliance of flesh without a stone [1].

        `t` [1] is the wave number of the pressure times the thickness.
        """
        return _burmister(t, 0.0, self.poisson)  # 0 is the code for a rigid base

    @cached_property
    def base_effect(self) -> CubicSpline:
        """Return, as a function of distance [mm], the change in deflection due to the stone.

        It is the deflection per force, times pi E*, minus 1 / r [1/mm].
        """
        return _base_effect(self.compliance, self.thickness, self.stiffness)


def _burmister(t: Floats, stiffness: float, poisson: float) -> Floats:
    """Return Burmister's transform: the compliance of a layer on a base over that of a half-space of its material [1].

    `t` [1] is the wave number times the thickness of the layer. The layer is `stiffness` times as stiff as its base; 0
    means a rigid base. Layer and base have the same Poisson's ratio.
    """
    k = 3.0 - 4.0 * poisson
    upper = (stiffness - 1.0) / (stiffness + k)
    lower = k * (stiffness - 1.0) / (1.0 + stiffness * k)
    decay, decay_squared = np.exp(-2.0 * t), np.exp(-4.0 * t)
    numerator = 1.0 + 4.0 * t * upper * decay - lower * upper * decay_squared
    return numerator / (1.0 - (lower + upper + 4.0 * upper * t**2) * decay + lower * upper * decay_squared)


def _base_effect(compliance: Callable[[Floats], Floats], thickness: float, stiffness: float) -> CubicSpline:
    """Return the change in deflection per force due to a base below a layer, times pi E* [1/mm], against distance [mm].

    It is the inverse Hankel transform of `compliance` - 1.
    """
    t = np.linspace(0.0, 15.0, 3001)
    r = thickness * np.concatenate([np.linspace(0.0, 4.0, 81), np.geomspace(4.0, 40.0, 60)[1:]])
    waves = (compliance(t) - 1.0) * j0(t * r[:, None] / thickness)
    return CubicSpline(r, np.asarray(np.trapezoid(waves, t, axis=-1)) / (stiffness * thickness))


@dataclass(frozen=True, kw_only=True)
class EllipsoidFruit:
    """An ellipsoidal fruit in the frame of the sensor, with optional deviations of its skin and its flesh.

    `E` [MPa] and `poisson` are the elastic constants. `R1` and `R2` [mm] are the principal radii, the first in the
    direction `azimuth` [deg] from +x. The side of the sensor at `tilt_azimuth` is lowered by `tilt` [deg], and the apex
    of the fruit lies at `apex` [mm]. `heights` (tips,) [mm] is the protrusion of each dome.

    `bumps` returns the height added to the skin [mm] at x, y [mm]. Under each dome, within a hemisphere of
    `soft_radius` (tips,) [mm], the flesh is `softness` (tips,) times as soft as elsewhere [1]. Flesh yields at the
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
        """Return two numbers for each dome, shape (2, tips), that describe soft flesh under it.

        The first is the compliance of the soft flesh over the compliance of the flesh elsewhere [1]. The second is a
        constant that is added to the deflection per force, times pi E* [1/mm].
        """
        softness, radius = np.broadcast_arrays(self.softness, self.soft_radius)
        constant = BRUISE[0] + BRUISE[1] * (self.poisson - 0.3)
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
        """Return the slope of the skin at the apex along x and y, in the frame of the sensor [1], shape (2,)."""
        angle = math.radians(self.tilt_azimuth)
        return math.tan(math.radians(self.tilt)) * np.array([math.cos(angle), math.sin(angle)])

    @property
    def compliance(self) -> float:
        """Return (1 - nu^2) / (pi E), the deflection under a point load times the distance over the load [mm^2/N]."""
        return (1.0 - self.poisson**2) / (math.pi * self.E)
