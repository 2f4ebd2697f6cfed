"""Verdicts on a bracket: its distances from the moving parts, the flange screws and the fruit."""

import cadquery as cq

from cad.checks.clearance import fruit_clearance_verdict, moving_part
from cad.checks.near_faces import PLACE_TOLERANCE_MM
from cad.fabrication.mount import HEAD_ROOM_MM, flange_heads
from cad.parts.assembly import plate_locations
from cad.parts.sensor import SensorSolids
from sensor.design.processes import Process
from sensor.verdict import Verdict, judge

_BOX_MM = 1e3  # width of a box that is larger than any sensor
# The heads of the flange screws touch the shelf, so their distance is measured only from parts this far below it.
_BELOW_SHELF_MM = 0.5


def mount_verdicts(sensor: SensorSolids, bracket: cq.Shape, process: Process) -> tuple[Verdict, ...]:
    """Return geometry.mount_clearance and geometry.mount_over_fruit [mm] for a bracket, drawn or read from a file."""
    return (
        _clearance_verdict(sensor, bracket, process),
        fruit_clearance_verdict("geometry.mount_over_fruit", sensor, bracket),
    )


def _clearance_verdict(sensor: SensorSolids, bracket: cq.Shape, process: Process) -> Verdict:
    """Return geometry.mount_clearance, the verdict on the smallest of three distances [mm].

    The first is the distance from the bracket to the moving parts at their stops. The others are the distances from the
    heads of the flange screws to the housing, and to the bracket below its shelf. The limit is the smallest gap that
    `process` can print.
    """
    housing = sensor.housing
    heads = flange_heads(sensor)
    distances = [float(_part_below_shelf(sensor, bracket).distance(heads))]
    for placement in plate_locations(housing):
        distances.append(float(sensor.part.shape.moved(placement).distance(heads)))
        for arm in housing.arms:
            # A moving part is at its stop when the top of its shuttle has risen to the cavity level.
            stop = cq.Location(cq.Vector(0.0, 0.0, housing.cavity_level - arm.top_level))
            distances.append(float(moving_part(sensor, arm).moved(placement * stop).distance(bracket)))
    reference = f"smallest distance between bracket and moving parts, or around the flange screws; {process.name}"
    return judge(
        "geometry.mount_clearance", min(distances), reference, limit=process.min_gap_mm, tolerance=PLACE_TOLERANCE_MM
    )


def _part_below_shelf(sensor: SensorSolids, bracket: cq.Shape) -> cq.Shape:
    """Return the part of a bracket that is at least `_BELOW_SHELF_MM` below its shelf [mm]."""
    upper_level = sensor.housing.top_level + HEAD_ROOM_MM - _BELOW_SHELF_MM
    corner = cq.Vector(-0.5 * _BOX_MM, -0.5 * _BOX_MM, upper_level - _BOX_MM)
    return bracket.intersect(cq.Solid.makeBox(_BOX_MM, _BOX_MM, _BOX_MM, corner))
