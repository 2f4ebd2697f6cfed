"""Verdicts on the bracket, as it is read back from its file: its holes meet their screws, and nothing that moves."""

import math

import cadquery as cq

from cad.checks.assembly_checks import hole_axes, holes_verdict
from cad.checks.clearance import fruit_clearance_verdict, moving_part
from cad.checks.tip_checks import PLACE_TOLERANCE_MM
from cad.fabrication.mount import FLANGE_HOLE_MM, HEAD_ROOM_MM, flange_heads, flange_holes
from cad.parts.part import is_hole
from cad.parts.pose import in_place
from cad.parts.sensor import SensorSolids
from sensor.design.processes import Process
from sensor.verdict import Verdict, at_least

_WIDE = 1e3  # [mm], beyond any sensor
_UNDER_SHELF_MM = 0.5  # the heads lie on the shelf: only what is below it may be near them


def mount_verdicts(sensor: SensorSolids, mount: cq.Shape, process: Process) -> tuple[Verdict, ...]:
    """Return geometry.mount_holes, _clearance and _over_fruit [mm] of a bracket, made or read from a file."""
    # The clearance from the fruit puts what it is given in its place in the sensor: here from the frame of the plate.
    back = 0.5 * sensor.housing.spacing if sensor.housing.back_to_back else 0.0
    in_plate_frame = mount.translate(cq.Vector(0.0, back, 0.0))
    return (
        _holes(sensor, mount),
        _clearance(sensor, mount, process),
        fruit_clearance_verdict("geometry.mount_over_fruit", sensor, in_plate_frame),
    )


def _holes(sensor: SensorSolids, mount: cq.Shape) -> Verdict:
    """Return how far a hole is off the housing's screw or off the circle of the flange: its axis, or its radius."""
    housing = sensor.housing
    faces = mount.Faces()
    across = hole_axes(face for face in faces if is_hole(face, housing.hole_diameter))
    upright = hole_axes((face for face in faces if _is_upright_hole(face)), second_axis="y")
    screws = sorted((x, z, 0.5 * housing.hole_diameter) for x, z in housing.holes)
    flange = sorted((x, y, 0.5 * FLANGE_HOLE_MM) for x, y in flange_holes(sensor))
    holes = {"the upright plate": (across, screws), "the shelf": (upright, flange)}
    return holes_verdict("geometry.mount_holes", holes, "the housing's screws and the flange ISO 9409-1-50-4-M6")


def _is_upright_hole(face: cq.Face) -> bool:
    box = face.BoundingBox()
    return face.geomType() == "CYLINDER" and math.isclose(box.xlen, box.ylen, abs_tol=PLACE_TOLERANCE_MM)


def _clearance(sensor: SensorSolids, mount: cq.Shape, process: Process) -> Verdict:
    """Return the least distance [mm] of the bracket from what moves, at its stops, and of the flange's heads."""
    housing = sensor.housing
    heads = flange_heads(sensor)
    under_heads = housing.top_level + HEAD_ROOM_MM - _UNDER_SHELF_MM
    corner = cq.Vector(-0.5 * _WIDE, -0.5 * _WIDE, under_heads - _WIDE)
    below = mount.intersect(cq.Solid.makeBox(_WIDE, _WIDE, _WIDE, corner))
    distances = [float(in_place(sensor.part.shape, housing).distance(heads)), float(below.distance(heads))]
    for arm in housing.arms:
        stop = cq.Vector(0.0, 0.0, housing.cavity_level - arm.top_level)
        distances.append(float(in_place(moving_part(sensor, arm).translate(stop), housing).distance(mount)))
    return at_least(
        "geometry.mount_clearance",
        min(distances),
        process.min_gap_mm,
        PLACE_TOLERANCE_MM,
        unit="mm",
        reference=f"least distance of the bracket from what moves, and of the flange's screws; {process.name}",
    )
