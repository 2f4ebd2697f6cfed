"""The outline of a rigid round tip in its meridian plane, as a signed distance.

Coordinates are r from the axis and z upwards from the lowest point of the tip, in tip sides.
"""

from dataclasses import dataclass

import numpy as np

from sensor.arrays import Flags, Floats


@dataclass(frozen=True, kw_only=True, eq=False)
class Distance:
    """Signed distance of points from a tip, negative inside, shape (points,), with its normal and curvature.

    `normal` (points, 2) is its gradient, `curvature` (points, 2, 2) its second derivative [1 / tip side]. `face`
    (points,) says where the nearest point of the tip is not on its side wall.
    """

    value: Floats
    normal: Floats
    curvature: Floats
    face: Flags


@dataclass(frozen=True, kw_only=True)
class RoundTip:
    """A flat round face of radius `radius` with its edge rounded by `edge`, and the side wall above it [tip sides]."""

    radius: float
    edge: float = 0.0

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
        # across its normal the distance is curved where a fillet is nearest
        tangent = np.eye(2) - normal[:, :, None] * normal[:, None, :]
        curvature = np.where(at_fillet, 1.0 / from_centre, 0.0)[:, None, None] * tangent
        return Distance(value=value, normal=normal, curvature=curvature, face=~at_wall)
