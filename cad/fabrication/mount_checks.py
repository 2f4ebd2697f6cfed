"""Verdicts on the bracket, as it is read back from its file: it meets nothing that moves, and no fruit."""

import cadquery as cq

from cad.checks.clearance import fruit_clearance_verdict, moving_part
from cad.checks.near_faces import PLACE_TOLERANCE_MM
from cad.fabrication.mount import HEAD_ROOM_MM, flange_heads
from cad.parts.assembly import plate_places
from cad.parts.sensor import SensorSolids
from sensor.design.processes import Process
from sensor.verdict import Verdict, judge

_WIDE = 1e3  # [mm], beyond any sensor
_UNDER_SHELF_MM = 0.5  # the heads lie on the shelf: only what is below it may be near them


def mount_verdicts(sensor: SensorSolids, mount: cq.Shape, process: Process) -> tuple[Verdict, ...]:
    """Return geometry.mount_clearance and _over_fruit [mm] of a bracket, made or read from a file."""
    return (
        _clearance(sensor, mount, process),
        fruit_clearance_verdict("geometry.mount_over_fruit", sensor, mount),
    )


def _clearance(sensor: SensorSolids, mount: cq.Shape, process: Process) -> Verdict:
    """Return the least distance [mm] of the bracket from what moves, at its stops, and of the flange's heads."""
    housing = sensor.housing
    heads = flange_heads(sensor)
    under_heads = housing.top_level + HEAD_ROOM_MM - _UNDER_SHELF_MM
    corner = cq.Vector(-0.5 * _WIDE, -0.5 * _WIDE, under_heads - _WIDE)
    below = mount.intersect(cq.Solid.makeBox(_WIDE, _WIDE, _WIDE, corner))
    plate = plate_places(housing)[0]
    distances = [float(sensor.part.shape.moved(plate).distance(heads)), float(below.distance(heads))]
    for arm in housing.arms:
        stop = cq.Location(cq.Vector(0.0, 0.0, housing.cavity_level - arm.top_level))
        distances.append(float(moving_part(sensor, arm).moved(plate * stop).distance(mount)))
    reference = f"least distance of the bracket from what moves, and of the flange's screws; {process.name}"
    return judge(
        "geometry.mount_clearance", min(distances), reference, limit=process.min_gap_mm, tolerance=PLACE_TOLERANCE_MM
    )
