"""Verdicts on the bracket, as it is read back from its file: its holes meet their screws, and nothing that moves."""

import math
from collections.abc import Iterable

import cadquery as cq
import numpy as np

from cad.checks.clearance import fruit_clearance_verdict, moving_part
from cad.checks.tip_checks import PLACE_TOLERANCE_MM
from cad.design.processes import Process
from cad.fabrication.mount import FLANGE_HOLE_MM, HEAD_ROOM_MM, flange_heads, flange_holes
from cad.parts.part import is_hole
from cad.parts.pose import in_place
from cad.parts.sensor import Sensor
from cad.verdict import Verdict, at_least, equal, failed

_WIDE = 1e3  # [mm], beyond any sensor
_UNDER_SHELF_MM = 0.5  # the heads lie on the shelf: only what is below it may be near them


def mount_verdicts(sensor: Sensor, mount: cq.Shape, process: Process) -> tuple[Verdict, ...]:
    """Return geometry.mount_holes, _clearance and _over_fruit [mm] of a bracket, made or read from a file."""
    return (
        _holes(sensor, mount),
        _clearance(sensor, mount, process),
        fruit_clearance_verdict("geometry.mount_over_fruit", sensor, _in_plate_frame(sensor, mount)),
    )


def _in_plate_frame(sensor: Sensor, mount: cq.Shape) -> cq.Shape:
    """Return the bracket in the frame of the plate [mm], from which the clearance from the fruit puts it in place."""
    return mount.translate(cq.Vector(0.0, 0.5 * sensor.housing.spacing, 0.0)) if sensor.housing.back_to_back else mount


def _holes(sensor: Sensor, mount: cq.Shape) -> Verdict:
    """Return how far a hole is off the housing's screw or off the circle of the flange: its axis, or its radius."""
    name, housing, faces = "geometry.mount_holes", sensor.housing, mount.Faces()
    across = _places((face for face in faces if is_hole(face, housing.hole_diameter)), 0, 2)
    upright = _places((face for face in faces if _is_upright_hole(face)), 0, 1)
    wanted = sorted((*place, 0.5 * housing.hole_diameter) for place in housing.holes)
    flange = sorted((*place, 0.5 * FLANGE_HOLE_MM) for place in flange_holes(sensor))
    if (len(across), len(upright)) != (len(wanted), len(flange)):
        reference = f"{len(across)} holes for the housing, {len(upright)} for the flange: must be 4 and 4"
        return failed(name, 0.0, unit="mm", reference=reference)
    off = max(float(np.abs(np.subtract(across, wanted)).max()), float(np.abs(np.subtract(upright, flange)).max()))
    reference = "axes and radii of the holes against the housing's screws and the flange ISO 9409-1-50-4-M6"
    return equal(name, off, 0.0, PLACE_TOLERANCE_MM, unit="mm", reference=reference)


def _is_upright_hole(face: cq.Face) -> bool:
    box = face.BoundingBox()
    return face.geomType() == "CYLINDER" and math.isclose(box.xlen, box.ylen, abs_tol=PLACE_TOLERANCE_MM)


def _places(faces: Iterable[cq.Face], first: int, second: int) -> list[tuple[float, float, float]]:
    """Return two coordinates of the axis and the radius of holes [mm], in order of their places."""
    found = []
    for face in faces:
        box = face.BoundingBox()
        centre = (box.center.x, box.center.y, box.center.z)
        found.append((round(centre[first], 6), round(centre[second], 6), round(0.5 * box.xlen, 6)))
    return sorted(found)


def _clearance(sensor: Sensor, mount: cq.Shape, process: Process) -> Verdict:
    """Return the least distance [mm] of the bracket from what moves, at its stops, and of the flange's heads."""
    housing = sensor.housing
    heads, under = flange_heads(sensor), housing.top_level + HEAD_ROOM_MM - _UNDER_SHELF_MM
    below = mount.intersect(cq.Solid.makeBox(_WIDE, _WIDE, _WIDE, cq.Vector(-0.5 * _WIDE, -0.5 * _WIDE, under - _WIDE)))
    distances = [float(shape.distance(heads)) for shape in (in_place(sensor.part.shape, housing), below)]
    for arm in housing.arms:
        stop = cq.Vector(0.0, 0.0, housing.cavity_level - arm.top_level)
        distances.append(float(in_place(moving_part(sensor, arm).translate(stop), housing).distance(mount)))
    reference = (
        f"least distance of the bracket from what moves, and of the flange's screws from the rest; {process.name}"
    )
    name = "geometry.mount_clearance"
    return at_least(name, min(distances), process.min_gap_mm, PLACE_TOLERANCE_MM, unit="mm", reference=reference)
