"""The map from a block to a curved fruit, which bends a mesh of the block into a mesh of the fruit.

The block has the plan and the thickness of the fruit: |x| <= length/2, |y| <= width/2, 0 <= z <= thickness, with z
down. On the skin near the tips, the map preserves x and y, so footprints remain squares and circles in plan. Lengths
are in mm.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from sensor.arrays import Floats
from sensor.design.fruit import Fruit

CORE_FRACTION = 0.65  # ratio of core size to cap size if the core determines the size of the cap
CAP_FRACTION = 0.85  # largest ratio of the polar angle of the cap to the polar angle of the base


class Plan(NamedTuple):
    """Half the size of a rectangle in plan, along x and y [mm]."""

    x: float
    y: float


def cap_gap(x: Floats, y: Floats, radius: float, radius_across: float) -> Floats:
    """Return the depth [mm] of a fruit's skin below the plane at its apex, or infinity outside the fruit's plan.

    The fruit is an ellipsoid whose vertical semi-axis is `radius` [mm]. Its principal radii at the apex are `radius`
    along x and `radius_across` along y. If both are equal, it is a sphere. The height h of the skin above the centre
    follows from

        (h / radius)^2 = 1 - (x / radius)^2 - y^2 / (radius radius_across).
    """
    relative_h_squared = 1.0 - (x / radius) ** 2 - y**2 / (radius * radius_across)
    return np.where(relative_h_squared >= 0.0, radius * (1.0 - np.sqrt(np.maximum(relative_h_squared, 0.0))), np.inf)


def cap_slope(x: float, y: float, radius: float, radius_across: float) -> tuple[float, float]:
    """Return the downward slopes [1] along x and y of the skin in `cap_gap`, or infinities at the rim and beyond."""
    relative_h_squared = 1.0 - (x / radius) ** 2 - y**2 / (radius * radius_across)
    if not relative_h_squared > 0.0:
        return math.inf, math.inf
    relative_height = math.sqrt(relative_h_squared)  # height above the centre divided by the vertical semi-axis
    return x / radius / relative_height, y / radius_across / relative_height


def fruit_gap(fruit: Fruit, x: Floats, y: Floats) -> Floats:
    """Return the depth [mm] of a curved fruit's skin below the plane at its apex, or infinity outside the plan."""
    return cap_gap(*fruit.to_principal(x, y), *fruit.radii_mm)


def fruit_slope(fruit: Fruit, x: float, y: float) -> tuple[float, float]:
    """Return the slopes [1] of a fruit's skin along and across the tips, or infinities at the rim and beyond."""
    along, across = cap_slope(*fruit.to_principal(x, y), *fruit.radii_mm)
    return (along, across) if math.isinf(along) else fruit.from_principal(along, across)


def ellipsoid_curvatures(semi_axes: Floats, from_centre: Floats) -> tuple[Floats, Floats]:
    """Return the mean curvature [1/mm] and the Gaussian curvature [1/mm^2] of ellipsoids at points on their surfaces.

    `semi_axes` [mm] and the positions `from_centre` [mm] of the points have shape (..., 3). Let a, b and c be the
    semi-axes, and r the distance from the centre. With g = (x / a^2, y / b^2, z / c^2), the curvatures are

        H = (a^2 + b^2 + c^2 - r^2) / (2 (a b c)^2 |g|^3),    K = 1 / ((a b c)^2 |g|^4).
    """
    gradient_squared = (from_centre**2 / semi_axes**4).sum(axis=-1)  # |g|^2
    product_squared = semi_axes.prod(axis=-1) ** 2  # (a b c)^2
    mean_numerator = (semi_axes**2).sum(axis=-1) - (from_centre**2).sum(axis=-1)
    mean = mean_numerator / (2.0 * product_squared * gradient_squared**1.5)
    gaussian = 1.0 / (product_squared * gradient_squared**2)
    return mean, gaussian


@dataclass(frozen=True)
class CurvedShape:
    """The map from a block to a fruit. `core` [mm] is half the size of the rectangle that contains the tips.

    For a piece of a fruit, the map shortens each vertical column of the block. A whole fruit has no corners. The top of
    the block becomes a cap around the apex, and its base becomes the base of the fruit. Its sides become the skin
    between them.
    """

    fruit: Fruit
    core: Plan

    @property
    def semi_axes(self) -> tuple[float, float, float]:
        """Return the semi-axes of the ellipsoid [mm]: along both principal directions, and along z."""
        radius, across = self.fruit.radii_mm
        return radius, math.sqrt(radius * across), radius

    @property
    def base_angle(self) -> float:
        """Return the polar angle from the apex to the rim of the base [rad].

        The angle is measured on a sphere whose radius is the vertical semi-axis.
        """
        return math.acos(1.0 - self.fruit.depth_mm / self.semi_axes[2])

    @property
    def cap_angle(self) -> float:
        """Return the polar angle from the apex to the rim of the cap [rad].

        The angle is chosen so that elements on the cap and on the sides have similar lengths. The core may require a
        larger cap, but part of the skin always remains for the sides.
        """
        balanced = self.base_angle / (1.0 + 2.0 * self.base_angle / math.pi)
        a, b, _ = self.semi_axes
        sine_for_core = max(self.core.x / (CORE_FRACTION * a), self.core.y / (CORE_FRACTION * b))
        angle_for_core = math.asin(min(1.0, sine_for_core))
        return min(CAP_FRACTION * self.base_angle, max(balanced, angle_for_core))

    @property
    def cap(self) -> Plan:
        """Return half the size in plan [mm] of the cap, which the top of the block becomes on a whole fruit."""
        sine = math.sin(self.cap_angle)
        return Plan(sine * self.semi_axes[0], sine * self.semi_axes[1])

    def slope(self, x: float, y: float) -> float:
        """Return the slope of the skin [1] at x, y [mm], or infinity at the rim and beyond."""
        return math.hypot(*fruit_slope(self.fruit, x, y))

    def normal(self, x: float, y: float) -> tuple[float, float, float]:
        """Return the unit outward normal of the skin at x, y [mm], with z down."""
        along, across = fruit_slope(self.fruit, x, y)
        length = math.hypot(along, across, 1.0)
        return along / length, across / length, -1.0 / length

    def mean_curvature(self, x: float, y: float) -> float:
        """Return the mean curvature of the skin [1/mm] at x, y [mm]."""
        height = self.semi_axes[2] - float(self._skin_depth(np.array(x), np.array(y)))
        from_centre = np.array([*self.fruit.to_principal(x, y), height])
        mean, _ = ellipsoid_curvatures(np.array(self.semi_axes), from_centre)
        return float(mean)

    def bend(self, points: Floats) -> Floats:
        """Return the positions in the fruit (3, n) [mm] of points of the block (3, n) [mm].

        In a piece of a fruit, each vertical column is moved down to the skin, and shortened so that it ends at the
        base. A skin keeps its thickness along the normal, and the flesh fills the rest of the column.
        """
        if self.fruit.is_whole:
            return self._bend_whole(points)
        if self.fruit.skin_mm is not None:
            return self._bend_with_skin(points, self.fruit.skin_mm)
        x, y, z = points
        skin_depth = self._skin_depth(x, y)
        depth = self.fruit.depth_mm
        return np.stack([x, y, skin_depth + z * (1.0 - skin_depth / depth)])

    def _bend_with_skin(self, points: Floats, skin_thickness: float) -> Floats:
        """Return the positions (3, n) [mm] of points of the block in a piece of a fruit with a skin.

        In the block, the skin is the layer from z = 0 to `skin_thickness` [mm]. In the fruit, the skin has this
        thickness along its normal, and is therefore thicker along the vertical.
        """
        x, y, z = points
        skin_depth = self._skin_depth(x, y)
        depth = self.fruit.depth_mm
        a, b, c = self.semi_axes
        u, v = self.fruit.to_principal(x, y)  # along the principal directions, which are the axes a and b
        # The slope of the skin is |(u / a^2, v / b^2)| c^2 / h, with the height h = c - skin_depth above the centre.
        slope = np.hypot(u / a**2, v / b**2) * c**2 / (c - skin_depth)
        secant = np.hypot(slope, 1.0)  # vertical thickness of the skin divided by its thickness along the normal
        skin_base = skin_depth + skin_thickness * secant
        flesh_fraction = np.maximum(0.0, z - skin_thickness) / (depth - skin_thickness)  # 0 at the skin, 1 at the base
        in_skin = np.minimum(z, skin_thickness) * secant  # vertical distance within the skin
        return np.stack([x, y, skin_depth + in_skin + flesh_fraction * (depth - skin_base)])

    def _skin_depth(self, x: Floats, y: Floats) -> Floats:
        """Return the depth of the skin below the apex [mm], at most the vertical semi-axis."""
        return np.minimum(fruit_gap(self.fruit, x, y), self.semi_axes[2])

    def _bend_whole(self, points: Floats) -> Floats:
        """Return the positions in a whole fruit (3, n) [mm] of points of the block (3, n) [mm].

        Each level of the block becomes a disc, which is an ellipse in plan. The top disc is the cap around the apex,
        and the bottom disc is the base. The rims of the discs between them form the skin between cap and base.
        """
        a, b, c = self.semi_axes
        thickness = self.fruit.depth_mm
        u, v = self._map_to_disc(points[:2])
        outward_share = u**2 + v**2  # 0 on the axis, 1 on the rim of a disc
        downward_share = points[2] / thickness  # 0 on the top, 1 on the base
        rim_angle = self.cap_angle + (self.base_angle - self.cap_angle) * downward_share  # polar angle of the rim [rad]
        relative_radius = self._disc_radius(outward_share, downward_share, rim_angle)
        # The depth is interpolated linearly from the cap to the base. At the rim, the bulge is added so that it becomes
        # the depth of the skin.
        bulge = c * self._relative_bulge(downward_share, rim_angle)
        top_depth = self._skin_depth(self.cap.x * u, self.cap.y * v)
        depth = (1.0 - downward_share) * top_depth + downward_share * thickness + outward_share * bulge
        return np.stack([a * relative_radius * u, b * relative_radius * v, depth])

    def _disc_radius(self, outward_share: Floats, downward_share: Floats, rim_angle: Floats) -> Floats:
        """Return the radius of the discs of `_bend_whole`, divided by the horizontal semi-axes [1], shape (n,).

        At the rim of a disc, where `outward_share` is 1, the radius follows the skin. On the axis, it is a smooth
        function of the depth. Between them, it is interpolated.
        """
        cap_sine = math.sin(self.cap_angle)
        base_sine = math.sin(self.base_angle)
        axis_radius = cap_sine + (base_sine - cap_sine) * downward_share**2
        return np.asarray((1.0 - outward_share) * axis_radius + outward_share * np.sin(rim_angle))

    def _relative_bulge(self, downward_share: Floats, rim_angle: Floats) -> Floats:
        """Return the depth of the skin minus a linear interpolation between the rims of cap and base, shape (n,).

        The depths are divided by the vertical semi-axis [1]. The result is zero at the rims of cap and base.
        """
        cap_depth = 1.0 - math.cos(self.cap_angle)  # of the rim of the cap
        base_depth = 1.0 - math.cos(self.base_angle)
        linear_depth = (1.0 - downward_share) * cap_depth + downward_share * base_depth
        return np.asarray(1.0 - np.cos(rim_angle) - linear_depth)

    def _map_to_disc(self, points: Floats) -> Floats:
        """Return the images (2, n) on the unit disc of points (2, n) [mm] of the block's plan.

        Points of the core are mapped to (x, y) / cap. At the edge of the plan, the map is the elliptical map of a
        square onto a disc. It takes (p, q) to (p sqrt(1 - q^2 / 2), q sqrt(1 - p^2 / 2)). In between, the two maps are
        blended.
        """
        half_plan = 0.5 * np.array([self.fruit.length_mm, self.fruit.width_mm])
        core = np.array(self.core)
        cap = np.array(self.cap)
        distance = np.abs(points)  # from the axes
        # `edge_share` increases from 0 in the core to 1 at the edge of the plan, separately along x and y. `rounding`
        # increases from 0 to 1/2, its value in the elliptical map.
        edge_share = np.maximum(0.0, (distance - core[:, None]) / (half_plan - core)[:, None])
        within_core = np.minimum(distance, core[:, None])  # the part of the distance that lies in the core
        # p and q are (x, y) / cap in the core. They increase to 1 at the edge of the plan.
        p, q = np.sign(points) * (within_core + edge_share * (cap - core)[:, None]) / cap[:, None]
        rounding = 0.5 * (1.0 - ((1.0 - edge_share[0] ** 2) * (1.0 - edge_share[1] ** 2)) ** 2)
        return np.stack([p * np.sqrt(1.0 - rounding * q**2), q * np.sqrt(1.0 - rounding * p**2)])
