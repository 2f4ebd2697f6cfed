"""Poses of the sensor: pressed on its fruit with any tilt, and flat on the print bed.

The axes of the sensor are defined in cad/parts/sensor.py. In print pose, the plate lies flat on z = 0, and its face
y = -depth / 2 is up. The x axis is unchanged, and the z axis of the sensor becomes the y axis. A plate with pads on its
back is printed with its back up. In this case, the y axis of the sensor becomes the z axis, and its z axis points
along -y.
"""

from __future__ import annotations

import math

import cadquery as cq
import numpy as np
import trimesh

from sensor.arrays import Floats

_QUARTER_TURN = 90.0  # [deg]
_MIDPOINT = cq.Vector(0.0, 0.0, 0.0)  # midpoint between the tips


def pressed_pose(travel: float, tilt: float, heading: float) -> cq.Location:
    """Return the location of a sensor that is lowered by `travel` [mm] and tilted about the midpoint of its tips.

    `tilt` [deg] is the angle of the rotation. `heading` [deg] is the direction in which the sensor leans: at 0, the
    side of the high tip is lowered, and at 90, the side at +y.
    """
    azimuth = math.radians(heading)
    axis = cq.Vector(-math.sin(azimuth), math.cos(azimuth), 0.0)
    return cq.Location(cq.Vector(0.0, 0.0, -travel)) * cq.Location(_MIDPOINT, axis, tilt)


def location_matrix(location: cq.Location) -> Floats:
    """Return the matrix (3, 4) of a location: the rotation [1], and the translation [mm] in the last column."""
    transform = location.wrapped.Transformation()
    return np.array([[transform.Value(row, column) for column in (1, 2, 3, 4)] for row in (1, 2, 3)])


def print_pose(shape: cq.Shape, *, back_up: bool = False) -> cq.Shape:
    """Move a shape from sensor coordinates to print pose [mm]. If `back_up` is true, its back is up."""
    angle = _QUARTER_TURN if back_up else -_QUARTER_TURN
    rotated = shape.rotate(cq.Vector(0.0, 0.0, 0.0), cq.Vector(1.0, 0.0, 0.0), angle)
    return rotated.translate(cq.Vector(0.0, 0.0, -rotated.BoundingBox().zmin))


def sensor_pose(mesh: trimesh.Trimesh, depth: float, *, back_up: bool = False) -> trimesh.Trimesh:
    """Move triangles from print pose to sensor coordinates [mm], for a plate of this depth [mm].

    This is the inverse of `print_pose`.
    """
    up = 1.0 if back_up else -1.0
    rotated = mesh.copy()
    rotated.vertices = mesh.vertices[:, [0, 2, 1]] * (1.0, up, -up) - (0.0, up * 0.5 * depth, 0.0)
    return rotated
