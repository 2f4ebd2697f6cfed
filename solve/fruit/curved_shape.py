"""Where the points of a block lie once the block has been bent into a curved fruit.

The map takes the block of the fruit's plan and thickness, |x| <= length/2, |y| <= width/2, 0 <= z <= thickness with z
down, onto the fruit. Plan coordinates stay what they are on the skin near the tips, so that footprints stay squares and
circles as seen from above. Units: mm.
"""

import math
from dataclasses import dataclass

import numpy as np

from cad.design.fruit import Fruit
from solve.arrays import Floats
from solve.fruit.skin import cap_gap, cap_slope

Plan = tuple[float, float]
Vector = tuple[float, float, float]

CORE_OF_CAP = 0.65  # the core of a cap that is as large as it should be for its core
CAP_OF_SKIN = 0.85  # the largest cap, in arc from the apex to the base


@dataclass(frozen=True)
class CurvedShape:
    """A fruit that falls away from its apex like an ellipsoid, and `core`, half of the plan [mm] that holds its tips.

    A piece of it takes each column of the block to a shorter one. A whole fruit has no corners: the top of the block
    becomes a cap about the apex, its sides the rest of the skin, its base the base.
    """

    fruit: Fruit
    core: Plan

    @property
    def semi_axes(self) -> tuple[float, float, float]:
        """Return the semi-axes of the ellipsoid along x, y and z [mm]."""
        radius, across = self.fruit.radii_mm
        return radius, math.sqrt(radius * across), radius

    @property
    def base_angle(self) -> float:
        """Return the angle from the apex to the rim of the base, seen from the centre of the sphere [rad]."""
        return math.acos(1.0 - self.fruit.depth_mm / self.semi_axes[2])

    @property
    def cap_angle(self) -> float:
        """Return the angle from the apex to the rim of the cap [rad]: skin and sides of the block are about as long.

        The cap is larger where the core asks for it, as long as sides are left.
        """
        even = self.base_angle / (1.0 + 2.0 * self.base_angle / math.pi)
        held = max(core / (CORE_OF_CAP * axis) for core, axis in zip(self.core, self.semi_axes[:2], strict=True))
        return min(CAP_OF_SKIN * self.base_angle, max(even, math.asin(min(1.0, held))))

    @property
    def cap(self) -> Plan:
        """Return half of the plan [mm] that the top of the block takes on a whole fruit."""
        share = math.sin(self.cap_angle)
        return share * self.semi_axes[0], share * self.semi_axes[1]

    def slope(self, x: float, y: float) -> float:
        """Return how steeply the skin falls at a place of the plan [1]; infinite from its rim on."""
        return math.hypot(*cap_slope(x, y, *self.fruit.radii_mm))

    def normal(self, x: float, y: float) -> Vector:
        """Return the outward normal of the skin at a place of the plan [1], z down."""
        along, across = cap_slope(x, y, *self.fruit.radii_mm)
        length = math.hypot(along, across, 1.0)
        return along / length, across / length, -1.0 / length

    def mean_curvature(self, x: float, y: float) -> float:
        """Return the mean curvature of the skin at a place of the plan [1/mm]."""
        a, b, c = self.semi_axes
        height = c - float(self._fall(np.array(x), np.array(y)))
        normal = (x / a**2) ** 2 + (y / b**2) ** 2 + (height / c**2) ** 2
        return float((a**2 + b**2 + c**2 - x**2 - y**2 - height**2) / (2.0 * (a * b * c) ** 2 * normal**1.5))

    def bent(self, points: Floats) -> Floats:
        """Return where points (3, n) [mm] of the block lie on the fruit."""
        if self.fruit.whole:
            return self._whole(points)
        x, y, z = points
        fall = self._fall(x, y)
        return np.stack([x, y, fall + z * (1.0 - fall / self.fruit.depth_mm)])

    def _fall(self, x: Floats, y: Floats) -> Floats:
        return np.asarray(np.minimum(cap_gap(x, y, *self.fruit.radii_mm), self.semi_axes[2]))

    def _whole(self, points: Floats) -> Floats:
        """Turn the plan of the block into discs, then each half section through the axis into one of the fruit."""
        sizes = 0.5 * np.array([self.fruit.length_mm, self.fruit.width_mm])
        u, v = _disc(points[:2], sizes, np.array(self.core), np.array(self.cap))
        share, down = u**2 + v**2, points[2] / self.fruit.depth_mm
        a, b, _ = self.semi_axes
        reach = self._reach(share, down)
        top = self._fall(self.cap[0] * u, self.cap[1] * v)
        depth = (1.0 - down) * top + down * self.fruit.depth_mm + share * self._bulge(down)
        return np.stack([a * reach * u, b * reach * v, depth])

    def _reach(self, share: Floats, down: Floats) -> Floats:
        """Return the radius of discs [1 of the ellipsoid]: that of the skin at its rim, rising slowly at its axis."""
        cap, base = math.sin(self.cap_angle), math.sin(self.base_angle)
        reach: Floats = (1.0 - share) * (cap + (base - cap) * down**2) + share * np.sin(self._angle(down))
        return reach

    def _bulge(self, down: Floats) -> Floats:
        """Return how much lower the skin beside the cap lies than a straight line from its rim to the base [mm]."""
        rim, base = 1.0 - math.cos(self.cap_angle), 1.0 - math.cos(self.base_angle)
        straight = (1.0 - down) * rim + down * base
        bulge: Floats = self.semi_axes[2] * (1.0 - np.cos(self._angle(down)) - straight)
        return bulge

    def _angle(self, down: Floats) -> Floats:
        angle: Floats = self.cap_angle + (self.base_angle - self.cap_angle) * down
        return angle


def _disc(plan: Floats, sizes: Floats, core: Floats, cap: Floats) -> Floats:
    """Return where points (2, points) of a rectangle lie on the unit disc [1]: the core keeps its place times 1 / cap.

    Outside the core this is the elliptical map of a square on a disc.
    """
    reach = np.abs(plan)
    beyond = np.maximum(0.0, (reach - core[:, None]) / (sizes - core)[:, None])
    p, q = np.sign(plan) * (np.minimum(reach, core[:, None]) + beyond * (cap - core)[:, None]) / cap[:, None]
    round_off = 0.5 * (1.0 - ((1.0 - beyond[0] ** 2) * (1.0 - beyond[1] ** 2)) ** 2)
    return np.stack([p * np.sqrt(1.0 - round_off * q**2), q * np.sqrt(1.0 - round_off * p**2)])
