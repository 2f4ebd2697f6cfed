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
    (points,) says where the nearest point of the tip is not on its side wall.
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
        across = r - self.seat
        down = self.edge - z
        at_fillet = (across > 0.0) & (down > 0.0)
        at_wall = ~at_fillet & (across >= down)
        from_centre = np.where(at_fillet, np.hypot(across, down), 1.0)

        normal_r = np.where(at_fillet, across / from_centre, at_wall)
        normal_z = -np.where(at_fillet, down / from_centre, ~at_wall)
        normal = np.column_stack([normal_r, normal_z])
        value = np.where(at_fillet, from_centre, np.maximum(across, down)) - self.edge
        if not self.wall:
            value = np.where(at_wall, np.inf, value)
        curvature = _curvature(normal, np.where(at_fillet, 1.0 / from_centre, 0.0))
        return Distance(value=value, normal=normal, curvature=curvature, face=~at_wall)


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
        length = np.hypot(*from_centre.T)
        normal = from_centre / length[:, None]
        face = np.ones(len(r), dtype=bool)
        return Distance(
            value=length - self.sphere, normal=normal, curvature=_curvature(normal, 1.0 / length), face=face
        )


def _curvature(normal: Floats, curvature: Floats) -> Floats:
    """Return second derivatives (points, 2, 2) of a distance that is curved across its normal (points, 2)."""
    tangent = np.eye(2) - normal[:, :, None] * normal[:, None, :]
    return np.asarray(curvature[:, None, None] * tangent)


TipProfile = FlatTip | Dome
