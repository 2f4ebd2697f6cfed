"""Poses of the sensor: pressed on its fruit with any tilt, and flat on the print bed.

The sensor frame is in cad/parts/sensor.py. In print pose the plate lies flat on z = 0 with its face y = -depth / 2 up.
The x axis is unchanged, and the old z axis is the new y axis. A plate with pads on its back has its back up instead.
Then the old y axis is the new z axis, and the old z axis points along -y.
"""

from __future__ import annotations

import math

import cadquery as cq
import numpy as np
import trimesh

from sensor.arrays import Floats

_QUARTER_TURN = 90.0
_MIDPOINT = cq.Vector(0.0, 0.0, 0.0)  # midpoint between the tips


def pressed_pose(travel: float, tilt: float, heading: float) -> cq.Location:
    """Return the place of a sensor lowered by the travel [mm] and tilted [deg] about the midpoint of its tips.

    The heading [deg] is the direction in the plane of the tips that the tilt lowers: 0 for the high tip, 90 for +y.
    """
    turn = math.radians(heading)
    axis = cq.Vector(-math.sin(turn), math.cos(turn), 0.0)
    return cq.Location(cq.Vector(0.0, 0.0, -travel)) * cq.Location(_MIDPOINT, axis, tilt)


def location_matrix(location: cq.Location) -> Floats:
    """Return the matrix (3, 4) of a location: the rotation [1], and the translation in the last column [mm]."""
    moved = location.wrapped.Transformation()
    return np.array([[moved.Value(row, column) for column in (1, 2, 3, 4)] for row in (1, 2, 3)])


def print_pose(shape: cq.Shape, *, back_up: bool = False) -> cq.Shape:
    """Return a shape, given in the sensor frame, in print pose [mm], on request with its back up."""
    angle = _QUARTER_TURN if back_up else -_QUARTER_TURN
    turned = shape.rotate(cq.Vector(0.0, 0.0, 0.0), cq.Vector(1.0, 0.0, 0.0), angle)
    return turned.translate(cq.Vector(0.0, 0.0, -turned.BoundingBox().zmin))


def sensor_pose(mesh: trimesh.Trimesh, depth: float, *, back_up: bool = False) -> trimesh.Trimesh:
    """Return triangles, given in print pose, in the sensor frame [mm], for a plate of this depth [mm].

    This is the inverse of `print_pose`.
    """
    up = 1.0 if back_up else -1.0
    turned = mesh.copy()
    turned.vertices = mesh.vertices[:, [0, 2, 1]] * (1.0, up, -up) - (0.0, up * 0.5 * depth, 0.0)
    return turned
