"""Verdicts on the bracket, as it is read back from its file: it meets nothing that moves, and no fruit."""

import cadquery as cq

from cad.checks.clearance import fruit_clearance_verdict, moving_part
from cad.checks.near_faces import PLACE_TOLERANCE_MM
from cad.fabrication.mount import HEAD_ROOM_MM, flange_heads
from cad.parts.pose import in_place
from cad.parts.sensor import SensorSolids
from sensor.design.processes import Process
from sensor.verdict import Verdict, judge

_WIDE = 1e3  # [mm], beyond any sensor
_UNDER_SHELF_MM = 0.5  # the heads lie on the shelf: only what is below it may be near them


def mount_verdicts(sensor: SensorSolids, mount: cq.Shape, process: Process) -> tuple[Verdict, ...]:
    """Return geometry.mount_clearance and _over_fruit [mm] of a bracket, made or read from a file."""
    # The clearance from the fruit puts what it is given in its place in the sensor: here from the frame of the plate.
    back = 0.5 * sensor.housing.spacing if sensor.housing.back_to_back else 0.0
    in_plate_frame = mount.translate(cq.Vector(0.0, back, 0.0))
    return (
        _clearance(sensor, mount, process),
        fruit_clearance_verdict("geometry.mount_over_fruit", sensor, in_plate_frame),
    )


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
    reference = f"least distance of the bracket from what moves, and of the flange's screws; {process.name}"
    return judge(
        "geometry.mount_clearance", min(distances), reference, limit=process.min_gap_mm, tolerance=PLACE_TOLERANCE_MM
    )
