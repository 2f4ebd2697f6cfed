"""The sensor and the fruit of a press: sprung domes, and an ellipsoid that may be uneven, bruised or layered.

**Deviations from an even ellipsoid.** A height map is added to the skin, and a form to the domes. A layer bonded to the
flesh is exact: Burmister's transform of its compliance replaces 1 / r. So is flesh on a rigid stone. Flesh may be
softer in a hemisphere under a dome. The dome's own compliance is then that of the softer flesh, less `BRUISE` / radius
for the flesh outside. Between domes, the flesh outside is used. The contact is assumed small compared with the
hemisphere. Flesh that yields carries at most its yield pressure.

Lengths are in mm, forces in N, moduli in MPa.
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
"""Deflection of a point per force due to flesh outside a hemisphere about it, times its radius and pi E*: the value at
a Poisson's ratio of 0.3, and its slope. From finite elements, within 3 % (`tests/solve/presses`)."""


@dataclass(frozen=True, kw_only=True)
class SprungDomes:
    """Domes of a radius [mm] at `positions` (tips, 2) [mm], each on its own spring `K` (tips,) [N/mm].

    `form` is the height of all domes above their spheres [mm] at distances [mm] from their axes. The domes end at the
    distance `rim` [mm].
    """

    dome_radius: float
    positions: np.ndarray
    K: np.ndarray
    form: Callable[[Floats], Floats] | None = None
    rim: float = math.inf


@dataclass(frozen=True)
class OuterLayer:
    """Flesh of a `thickness` [mm], larger than the cells, `stiffness` [1] times as stiff as the flesh bonded below it.

    D. M. Burmister, J. Appl. Phys. 16 (1945) 89; T. C. O'Sullivan, R. B. King, J. Tribol. 110 (1988) 235.
    """

    thickness: float
    stiffness: float
    poisson: float = 0.3

    def compliance(self, t: Floats) -> Floats:
        """Return the compliance over the compliance of the layer's material [1], at wave numbers times thickness."""
        return _burmister(t, self.stiffness, self.poisson)

    @cached_property
    def rest(self) -> CubicSpline:
        """Return the deflection by a unit force times pi E* of the base, less 1 / (stiffness r) [1/mm], over r."""
        return _rest(self.compliance, self.thickness, self.stiffness)


@dataclass(frozen=True)
class FleshOnStone:
    """Flesh of a `thickness` [mm] that is bonded to a rigid stone: K. L. Johnson, Contact Mechanics (1985), 5.8.

    `stiffness` is the modulus of the layer over the modulus of the fruit [1]. It is 1, because the layer is the flesh.
    """

    thickness: float
    poisson: float = 0.3
    stiffness: ClassVar[float] = 1.0

    def compliance(self, t: Floats) -> Floats:
        """Return the compliance over the compliance of flesh without a stone [1], at wave numbers times thickness."""
        return _burmister(t, 0.0, self.poisson)

    @cached_property
    def rest(self) -> CubicSpline:
        """Return the deflection by a unit force times pi E*, less 1 / r [1/mm], over r."""
        return _rest(self.compliance, self.thickness, self.stiffness)


def _burmister(t: Floats, stiffness: float, poisson: float) -> Floats:
    """Return the compliance of a layer on a base over the layer's own [1], at wave numbers times thickness.

    The layer is `stiffness` times as stiff as its base; 0 means a rigid base.
    """
    k = 3.0 - 4.0 * poisson
    upper = (stiffness - 1.0) / (stiffness + k)
    lower = k * (stiffness - 1.0) / (1.0 + stiffness * k)
    once, twice = np.exp(-2.0 * t), np.exp(-4.0 * t)
    above = 1.0 + 4.0 * t * upper * once - lower * upper * twice
    return above / (1.0 - (lower + upper + 4.0 * upper * t**2) * once + lower * upper * twice)


def _rest(compliance: Callable[[Floats], Floats], thickness: float, stiffness: float) -> CubicSpline:
    """Return the change by a base of the deflection by a unit force, times pi E* [1/mm], over the distance [mm]."""
    t = np.linspace(0.0, 15.0, 3001)
    r = thickness * np.concatenate([np.linspace(0.0, 4.0, 81), np.geomspace(4.0, 40.0, 60)[1:]])
    waves = (compliance(t) - 1.0) * j0(t * r[:, None] / thickness)
    return CubicSpline(r, np.asarray(np.trapezoid(waves, t, axis=-1)) / (stiffness * thickness))


@dataclass(frozen=True, kw_only=True)
class EllipsoidFruit:
    """A fruit: modulus [MPa], two principal radii [mm], direction of the first from +x, and pose of the sensor.

    The side of the sensor at `tilt_azimuth` is lowered by `tilt` [deg]; the apex lies at `apex` [mm]. `heights` (tips,)
    [mm] is the protrusion of each dome. `bumps` are heights added to the skin [mm] at x, y [mm].

    `softness` (tips,) is the modulus of the fruit over the modulus of the flesh under each dome, within a hemisphere of
    `soft_radius` (tips,) [mm]. Flesh yields at the pressure `yields` [MPa].
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
    def own(self) -> Floats:
        """Return the local compliance under each dome over that of the flesh [1], and a constant added to it [1/mm]."""
        softness, radius = np.broadcast_arrays(self.softness, self.soft_radius)
        outside = BRUISE[0] + BRUISE[1] * (self.poisson - 0.3)
        return np.stack([softness, (1.0 - softness) * outside / radius])

    @property
    def curvature(self) -> Floats:
        """Return the tensor of curvatures [1/mm], (2, 2)."""
        angle = math.radians(self.azimuth)
        along = np.array([math.cos(angle), math.sin(angle)])
        across = np.array([-along[1], along[0]])
        return np.outer(along, along) / self.R1 + np.outer(across, across) / self.R2

    @property
    def slope(self) -> Floats:
        """Return the slope of the skin along x and y in the frame of the sensor [1]."""
        angle = math.radians(self.tilt_azimuth)
        return math.tan(math.radians(self.tilt)) * np.array([math.cos(angle), math.sin(angle)])

    @property
    def compliance(self) -> float:
        """Return the deflection times the distance for a unit point load [mm^2/N]."""
        return (1.0 - self.poisson**2) / (math.pi * self.E)
