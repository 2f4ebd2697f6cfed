"""Verdicts on a cover, made or read from a file: its clearance from what moves and from the fruit, and its holes."""

from collections.abc import Iterable, Iterator

import cadquery as cq
import numpy as np

from cad.checks.clearance import fruit_clearance_verdict, moving_part
from cad.checks.tip_checks import PLACE_TOLERANCE_MM
from cad.design.processes import Process
from cad.parts.cover import turned
from cad.parts.sensor import Sensor
from cad.verdict import Verdict, at_least, equal, failed

_STEPS = (0.0, 0.5, 1.0)  # shares of the way to the stops


def cover_verdicts(sensor: Sensor, cover: cq.Shape, process: Process) -> tuple[Verdict, ...]:
    """Return geometry.cover_clearance, _holes and _over_fruit [mm] of a back cover, made or read, and its turned copy.

    Clearance is that of shuttles, necks and leaves at rest, half way and at their stops.
    """
    sides = {"back": cover, "front": turned(cover, sensor.housing)}
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


def _cylinders(faces: Iterable[cq.Face]) -> list[tuple[float, float, float]]:
    """Return x and z of the axis and the radius of upright holes [mm], in order of their places."""
    boxes = (face.BoundingBox() for face in faces)
    return sorted((round(box.center.x, 6), round(box.center.z, 6), round(0.5 * box.xlen, 6)) for box in boxes)
