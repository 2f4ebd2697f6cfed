"""Verdicts on what is put together: a cover, made or read from a file, on its housing; the plates of a square."""

from collections.abc import Iterable, Iterator

import cadquery as cq
import numpy as np

from cad.checks.clearance import fruit_clearance_verdict, moving_part
from cad.checks.tip_checks import PLACE_TOLERANCE_MM
from cad.design.processes import Process
from cad.parts.assembly import turned_twin
from cad.parts.cover_solid import turned
from cad.parts.part import is_hole
from cad.parts.pose import in_place
from cad.parts.sensor import Sensor
from cad.verdict import Verdict, at_least, equal, failed

PLATES_GAP_MM = 0.3  # plates that bow towards each other by half of it each, as thin prints do, still move freely
_STEPS = (0.0, 0.5, 1.0)  # shares of the way to the stops


def cover_verdicts(sensor: Sensor, cover: cq.Shape, process: Process) -> tuple[Verdict, ...]:
    """Return geometry.cover_clearance, _holes and _over_fruit [mm] of a back cover, made or read, and its turned copy.

    Clearance is that of shuttles, necks and leaves at rest, half way and at their stops. A plate of a square has a
    cover on its front alone.
    """
    sides = {} if sensor.housing.back_to_back else {"back": cover}
    sides["front"] = turned(cover, sensor.housing)
    return (
        _clearance(sensor, sides, process),
        _holes(sensor, sides),
        fruit_clearance_verdict("geometry.cover_over_fruit", sensor, cq.Compound.makeCompound(list(sides.values()))),
    )


def _clearance(sensor: Sensor, sides: dict[str, cq.Shape], process: Process) -> Verdict:
    poses = list(_poses(sensor))
    distances = [(float(shape.distance(arm)), side, pose) for pose, arm in poses for side, shape in sides.items()]
    distance, side, pose = min(distances)
    name, limit = "geometry.cover_clearance", process.min_gap_mm
    reference = f"least distance of what moves from a cover: {side}, {pose}; {process.name}"
    return at_least(name, distance, limit, PLACE_TOLERANCE_MM, unit="mm", reference=reference)


def _poses(sensor: Sensor) -> Iterator[tuple[str, cq.Shape]]:
    """Yield the arms moved as a whole towards their stops, which is farther than any leaf of them goes."""
    for arm in sensor.housing.arms:
        shape, stop = moving_part(sensor, arm), sensor.housing.cavity_level - arm.top_level
        for share in _STEPS:
            yield f"{100.0 * share:g} % of the way to the stop", shape.translate(cq.Vector(0.0, 0.0, share * stop))


def _holes(sensor: Sensor, sides: dict[str, cq.Shape]) -> Verdict:
    """Return how far a hole of a cover is off that of the housing: its axis, or its radius."""
    name, limit, off = "geometry.cover_holes", len(sensor.housing.holes), 0.0
    every = sensor.part.shape.Faces()
    declared = _cylinders(every[index] for index in sensor.part.faces["mounting_holes"])
    for side, shape in sides.items():
        drilled = _cylinders(face for face in shape.Faces() if face.geomType() == "CYLINDER")
        if not len(drilled) == len(declared) == limit:
            reference = (
                f"{len(drilled)} holes in the {side} cover, {len(declared)} in the housing: must be {limit} each"
            )
            return failed(name, 0.0, unit="mm", reference=reference)
        off = max(off, float(np.abs(np.subtract(drilled, declared)).max()))
    reference = f"axes and radii of {limit} holes in each cover against the housing's"
    return equal(name, off, 0.0, PLACE_TOLERANCE_MM, unit="mm", reference=reference)


def plate_verdicts(sensor: Sensor) -> tuple[Verdict, ...]:
    """Return geometry.plates and geometry.plate_holes [mm] of the two plates of a square; none for another sensor.

    Plates that run into each other, or whose pads do not meet, fail; else the value is the least distance of what moves
    in one plate, at rest, half way and at its stop, from the other.
    """
    if not sensor.housing.back_to_back:
        return ()
    plate = in_place(sensor.part.shape, sensor.housing)
    return _plates(sensor, plate, turned_twin(plate)), _plate_holes(sensor)


def _plates(sensor: Sensor, plate: cq.Shape, twin: cq.Shape) -> Verdict:
    name = "geometry.plates"
    shared = sum(solid.Volume() for solid in plate.intersect(twin).Solids())
    if shared > 0.0:
        reference = f"the plates run into each other, {shared:.3g} mm^3 of them in the same place"
        return failed(name, PLATES_GAP_MM, unit="mm", reference=reference)
    apart = float(plate.distance(twin))
    if apart > PLACE_TOLERANCE_MM:
        reference = f"the pads of the plates do not meet: screws would bend the plates by {apart:.3g} mm"
        return failed(name, PLATES_GAP_MM, unit="mm", reference=reference)
    distances = [(float(in_place(arm, sensor.housing).distance(twin)), pose) for pose, arm in _poses(sensor)]
    least, pose = min(distances)
    reference = f"plates meet at their pads; least distance of what moves in one from the other, {pose}"
    return at_least(name, least, PLATES_GAP_MM, PLACE_TOLERANCE_MM, unit="mm", reference=reference)


def _plate_holes(sensor: Sensor) -> Verdict:
    """Return how far a hole for a screw or a dowel is off that of the turned plate: its axis, or its radius."""
    name, housing = "geometry.plate_holes", sensor.housing
    sizes = (housing.hole_diameter, housing.dowel_hole)
    drilled = _cylinders(face for face in sensor.part.shape.Faces() if any(is_hole(face, size) for size in sizes))
    expected = len(housing.holes) + len(housing.dowels)
    if len(drilled) != expected:
        reference = f"{len(drilled)} holes for screws and dowels in a plate: must be {expected}"
        return failed(name, 0.0, unit="mm", reference=reference)
    other = sorted((-x, z, radius) for x, z, radius in drilled)
    off = float(np.abs(np.subtract(drilled, other)).max())
    reference = f"axes and radii of {expected} holes for screws and dowels in one plate against the turned one's"
    return equal(name, off, 0.0, PLACE_TOLERANCE_MM, unit="mm", reference=reference)


def _cylinders(faces: Iterable[cq.Face]) -> list[tuple[float, float, float]]:
    """Return x and z of the axis and the radius of upright holes [mm], in order of their places."""
    boxes = (face.BoundingBox() for face in faces)
    return sorted((round(box.center.x, 6), round(box.center.z, 6), round(0.5 * box.xlen, 6)) for box in boxes)
