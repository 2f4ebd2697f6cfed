"""The outline of a rigid round tip in its meridian plane, as a signed distance.

Coordinates are r from the axis and z upwards from the lowest point of the tip, in tip sides.
"""

from dataclasses import dataclass

import numpy as np

from solve.arrays import Flags, Floats


@dataclass(frozen=True, kw_only=True, eq=False)
class Distance:
    """Signed distance of points from a tip, negative inside, shape (points,), with its normal and curvature.

    `normal` (points, 2) is its gradient, `curvature` (points, 2, 2) its second derivative [1 / tip side], and `face`
    (points,) says where the nearest place of the tip is not its side wall.
    """

    value: Floats
    normal: Floats
    curvature: Floats
    face: Flags


@dataclass(frozen=True, kw_only=True)
class FlatTip:
    """A flat round face of radius `radius` with its edge rounded by `edge`, and the side wall above it [tip sides].

    With `wall` left out nothing stops the flesh beside the face, which is wrong and here for comparison only.
    """

    radius: float
    edge: float = 0.0
    wall: bool = True

    @property
    def seat(self) -> float:
        """Return the radius up to which the tip touches at once [tip sides]."""
        return self.radius - self.edge

    def distance(self, r: Floats, z: Floats) -> Distance:
        """Return the signed distance of points r, z [tip sides], each (points,)."""
        across, down = r - self.seat, self.edge - z
        rounded = (across > 0.0) & (down > 0.0)
        on_wall = ~rounded & (across >= down)
        reach = np.where(rounded, np.hypot(across, down), 1.0)
        normal = np.column_stack(
            [np.where(rounded, across / reach, on_wall), -np.where(rounded, down / reach, ~on_wall)]
        )
        value = np.where(rounded, reach, np.maximum(across, down)) - self.edge
        if not self.wall:
            value = np.where(on_wall, np.inf, value)
        curvature = _bend(normal, np.where(rounded, 1.0 / reach, 0.0))
        return Distance(value=value, normal=normal, curvature=curvature, face=~on_wall)


@dataclass(frozen=True, kw_only=True)
class Dome:
    """A sphere of radius `sphere` that touches within `radius` of its axis [tip sides]."""

    radius: float
    sphere: float = 1.0

    @property
    def seat(self) -> float:
        """Return 0: a sphere first touches in a point [tip sides]."""
        return 0.0

    @property
    def deepest(self) -> float:
        """Return the depth at which Hertz's contact has nine tenths of the radius [tip sides]."""
        return (0.9 * self.radius) ** 2 / self.sphere

    def distance(self, r: Floats, z: Floats) -> Distance:
        """Return the signed distance of points r, z [tip sides], each (points,)."""
        from_centre = np.column_stack([r, z - self.sphere])
        reach = np.hypot(*from_centre.T)
        normal = from_centre / reach[:, None]
        face = np.ones(len(r), dtype=bool)
        return Distance(value=reach - self.sphere, normal=normal, curvature=_bend(normal, 1.0 / reach), face=face)


def _bend(normal: Floats, curvature: Floats) -> Floats:
    """Return second derivatives (points, 2, 2) of a distance that is bent across its normal (points, 2)."""
    across = np.eye(2) - normal[:, :, None] * normal[:, None, :]
    return np.asarray(curvature[:, None, None] * across)


TipProfile = FlatTip | Dome
