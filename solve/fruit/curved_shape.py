"""The map of a block onto a curved fruit, which bends a mesh of the block into a mesh of the fruit.

It takes the block of the fruit's plan and thickness, |x| <= length/2, |y| <= width/2, 0 <= z <= thickness with z down,
to the fruit. On the skin near the tips it keeps the plan coordinates, so that footprints remain squares and circles
seen from above. Units: mm.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from sensor.arrays import Floats
from sensor.design.fruit import Fruit

CORE_OF_CAP = 0.65  # core over cap, if the core determines the size of the cap
CAP_OF_SKIN = 0.85  # largest cap over the arc from the apex to the base


class Plan(NamedTuple):
    """Half the size of a rectangle in the plan, along x and y [mm]."""

    x: float
    y: float


def cap_gap(x: Floats, y: Floats, radius: float, radius_across: float) -> Floats:
    """Return the depth [mm] of a fruit with these radii below the plane at its apex; infinity beyond the fruit.

    It is an ellipsoid with the vertical semi-axis `radius`, and a sphere if both radii are equal.
    """
    rest = 1.0 - (x / radius) ** 2 - y**2 / (radius * radius_across)
    return np.where(rest >= 0.0, radius * (1.0 - np.sqrt(np.maximum(rest, 0.0))), np.inf)


def cap_slope(x: float, y: float, radius: float, radius_across: float) -> tuple[float, float]:
    """Return the slopes [1] at which such a fruit falls along x and along y; infinite at its rim and beyond."""
    rest = 1.0 - (x / radius) ** 2 - y**2 / (radius * radius_across)
    if not rest > 0.0:
        return math.inf, math.inf
    fall = math.sqrt(rest)
    return x / radius / fall, y / radius_across / fall


def fruit_gap(fruit: Fruit, x: Floats, y: Floats) -> Floats:
    """Return the depth [mm] of a curved fruit below the plane at its apex; infinity beyond the fruit."""
    return cap_gap(*fruit.to_principal(x, y), *fruit.radii_mm)


def fruit_slope(fruit: Fruit, x: float, y: float) -> tuple[float, float]:
    """Return the slopes [1] at which a curved fruit falls along and across the tips; infinite at its rim and beyond."""
    along, across = cap_slope(*fruit.to_principal(x, y), *fruit.radii_mm)
    return (along, across) if math.isinf(along) else fruit.from_principal(along, across)


def ellipsoid_curvatures(semi_axes: Floats, from_centre: Floats) -> tuple[Floats, Floats]:
    """Return the mean [1/mm] and the Gaussian curvature [1/mm^2] of ellipsoids at points from their centres [mm].

    Semi-axes and points have the shape (..., 3).
    """
    normal = (from_centre**2 / semi_axes**4).sum(axis=-1)
    volume = semi_axes.prod(axis=-1) ** 2
    mean = ((semi_axes**2).sum(axis=-1) - (from_centre**2).sum(axis=-1)) / (2.0 * volume * normal**1.5)
    return mean, 1.0 / (volume * normal**2)


@dataclass(frozen=True)
class CurvedShape:
    """The map of a block onto a fruit; `core` is half the plan [mm] that contains its tips.

    A piece of a fruit shortens each column of the block. A whole fruit has no corners: the top of the block becomes a
    cap about the apex, its sides the rest of the skin, and its base the base.
    """

    fruit: Fruit
    core: Plan

    @property
    def semi_axes(self) -> tuple[float, float, float]:
        """Return the semi-axes of the ellipsoid [mm]: along and across its principal directions, and along z."""
        radius, across = self.fruit.radii_mm
        return radius, math.sqrt(radius * across), radius

    @property
    def base_angle(self) -> float:
        """Return the angle from the apex to the rim of the base, as a sphere of the vertical semi-axis has it [rad]."""
        return math.acos(1.0 - self.fruit.depth_mm / self.semi_axes[2])

    @property
    def cap_angle(self) -> float:
        """Return the angle from the apex to the rim of the cap [rad].

        The skin of the cap and the sides of the block then have about the same length. The cap is larger if the core
        requires it, but leaves some skin to the sides.
        """
        even = self.base_angle / (1.0 + 2.0 * self.base_angle / math.pi)
        a, b, _ = self.semi_axes
        for_core = max(self.core.x / (CORE_OF_CAP * a), self.core.y / (CORE_OF_CAP * b))
        return min(CAP_OF_SKIN * self.base_angle, max(even, math.asin(min(1.0, for_core))))

    @property
    def cap(self) -> Plan:
        """Return half the plan [mm] of the cap, which the top of the block becomes on a whole fruit."""
        sine = math.sin(self.cap_angle)
        return Plan(sine * self.semi_axes[0], sine * self.semi_axes[1])

    def slope(self, x: float, y: float) -> float:
        """Return the slope of the skin at a point of the plan [1]; infinite at its rim and beyond."""
        return math.hypot(*fruit_slope(self.fruit, x, y))

    def normal(self, x: float, y: float) -> tuple[float, float, float]:
        """Return the outward normal of the skin at a point of the plan [1], z down."""
        along, across = fruit_slope(self.fruit, x, y)
        length = math.hypot(along, across, 1.0)
        return along / length, across / length, -1.0 / length

    def mean_curvature(self, x: float, y: float) -> float:
        """Return the mean curvature of the skin at a point of the plan [1/mm]."""
        height = self.semi_axes[2] - float(self._fall(np.array(x), np.array(y)))
        from_centre = np.array([*self.fruit.to_principal(x, y), height])
        mean, _ = ellipsoid_curvatures(np.array(self.semi_axes), from_centre)
        return float(mean)

    def bend(self, points: Floats) -> Floats:
        """Return the positions on the fruit (3, n) [mm] of points (3, n) [mm] of the block.

        On a piece of a fruit, each column of the block is moved down to the skin and shortened to end at the base. A
        skin keeps its thickness along the normal, and the flesh below fills the rest of the column.
        """
        if self.fruit.whole:
            return self._bent_whole(points)
        x, y, z = points
        fall = self._fall(x, y)
        skin = self.fruit.skin_mm
        depth = self.fruit.depth_mm
        if skin is None:
            return np.stack([x, y, fall + z * (1.0 - fall / depth)])
        a, b, c = self.semi_axes
        u, v = self.fruit.to_principal(x, y)
        lean = np.hypot(np.hypot(u / a**2, v / b**2) * c**2 / (c - fall), 1.0)  # 1 / cos(slope)
        skin_base = fall + skin * lean
        flesh_fraction = np.maximum(0.0, z - skin) / (depth - skin)
        return np.stack([x, y, fall + np.minimum(z, skin) * lean + flesh_fraction * (depth - skin_base)])

    def _fall(self, x: Floats, y: Floats) -> Floats:
        return np.minimum(fruit_gap(self.fruit, x, y), self.semi_axes[2])

    def _bent_whole(self, points: Floats) -> Floats:
        """Return the positions of points of the block on a whole fruit, both (3, n) [mm].

        Each level of the block becomes a disc, an ellipse seen from above. The top disc is the cap about the apex, the
        bottom disc the base. The rims of the discs between them form the rest of the skin.
        """
        a, b, c = self.semi_axes
        thickness = self.fruit.depth_mm
        cap_sine = math.sin(self.cap_angle)
        base_sine = math.sin(self.base_angle)
        rim_depth = 1.0 - math.cos(self.cap_angle)
        base_depth = 1.0 - math.cos(self.base_angle)

        u, v = self._on_disc(points[:2])
        outwards = u**2 + v**2  # 0 on the axis, 1 on the rim of a disc
        down = points[2] / thickness  # 0 on the top, 1 on the base
        angle = self.cap_angle + (self.base_angle - self.cap_angle) * down  # angle of the rim from the apex [rad]

        # Radius of the discs over the semi-axes: at the rim the radius of the skin, at the axis a smooth function of
        # depth.
        at_axis = cap_sine + (base_sine - cap_sine) * down**2
        radius = (1.0 - outwards) * at_axis + outwards * np.sin(angle)
        # Depth of the skin beside the cap below a straight line from the rim of the cap to the base [mm].
        straight = (1.0 - down) * rim_depth + down * base_depth
        bulge = c * (1.0 - np.cos(angle) - straight)
        top = self._fall(self.cap.x * u, self.cap.y * v)
        depth = (1.0 - down) * top + down * thickness + outwards * bulge
        return np.stack([a * radius * u, b * radius * v, depth])

    def _on_disc(self, plan: Floats) -> Floats:
        """Return the images (2, n) on the unit disc of points (2, n) [mm] of the block's plan.

        Points of the core map to (x, y) / cap. At the edge of the plan the map is the elliptical one of a square onto a
        disc, (p, q) to (p sqrt(1 - q^2 / 2), q sqrt(1 - p^2 / 2)). Between core and edge both are blended.
        """
        half_plan = 0.5 * np.array([self.fruit.length_mm, self.fruit.width_mm])
        core = np.array(self.core)
        cap = np.array(self.cap)
        distance = np.abs(plan)
        # `beyond` is 0 in the core and 1 at the edge of the plan; `rounding` grows from 0 to the 1/2 of the elliptical
        # map
        beyond = np.maximum(0.0, (distance - core[:, None]) / (half_plan - core)[:, None])
        within = np.minimum(distance, core[:, None])
        p, q = np.sign(plan) * (within + beyond * (cap - core)[:, None]) / cap[:, None]
        rounding = 0.5 * (1.0 - ((1.0 - beyond[0] ** 2) * (1.0 - beyond[1] ** 2)) ** 2)
        return np.stack([p * np.sqrt(1.0 - rounding * q**2), q * np.sqrt(1.0 - rounding * p**2)])
