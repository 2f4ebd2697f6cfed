"""Poses of the sensor: pressed on its fruit with any tilt, and flat on the print bed.

The axes of the sensor are defined in cad/parts/sensor.py. In print pose the plate lies flat on z = 0 with its face y =
-depth / 2 up. The x axis is unchanged, and the old z axis is the new y axis. A plate with pads on its back has its back
up instead. Then the old y axis is the new z axis, and the old z axis points along -y.
"""

from __future__ import annotations

import math

import cadquery as cq
import numpy as np
import trimesh

from sensor.arrays import Floats

_QUARTER_TURN = 90.0  # deg
_MIDPOINT = cq.Vector(0.0, 0.0, 0.0)  # midpoint between the tips


def pressed_pose(travel: float, tilt: float, heading: float) -> cq.Location:
    """Return the location of a sensor that is lowered by `travel` [mm] and tilted about the midpoint of its tips.

    `tilt` [deg] is the angle of the rotation. `heading` [deg] is the direction in the plane of the tips that the tilt
    lowers: 0 for the high tip, 90 for +y.
    """
    azimuth = math.radians(heading)
    axis = cq.Vector(-math.sin(azimuth), math.cos(azimuth), 0.0)
    return cq.Location(cq.Vector(0.0, 0.0, -travel)) * cq.Location(_MIDPOINT, axis, tilt)


def location_matrix(location: cq.Location) -> Floats:
    """Return the matrix (3, 4) of a location: the rotation [1], and in the last column the translation [mm]."""
    transform = location.wrapped.Transformation()
    return np.array([[transform.Value(row, column) for column in (1, 2, 3, 4)] for row in (1, 2, 3)])


def print_pose(shape: cq.Shape, *, back_up: bool = False) -> cq.Shape:
    """Return a shape in print pose [mm], given in sensor coordinates; with `back_up` its back is up."""
    angle = _QUARTER_TURN if back_up else -_QUARTER_TURN
    rotated = shape.rotate(cq.Vector(0.0, 0.0, 0.0), cq.Vector(1.0, 0.0, 0.0), angle)
    return rotated.translate(cq.Vector(0.0, 0.0, -rotated.BoundingBox().zmin))


def sensor_pose(mesh: trimesh.Trimesh, depth: float, *, back_up: bool = False) -> trimesh.Trimesh:
    """Return triangles in sensor coordinates [mm], given in print pose, for a plate of this depth [mm].

    This is the inverse of `print_pose`.
    """
    up = 1.0 if back_up else -1.0
    rotated = mesh.copy()
    rotated.vertices = mesh.vertices[:, [0, 2, 1]] * (1.0, up, -up) - (0.0, up * 0.5 * depth, 0.0)
    return rotated
