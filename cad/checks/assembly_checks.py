"""Verdicts on what is put together: a cover, made or read from a file, on its housing; the plates of a square."""

from collections.abc import Iterable, Mapping

import cadquery as cq
import numpy as np

from cad.checks.clearance import fruit_clearance_verdict, moving_part
from cad.checks.near_faces import nearest_pair
from cad.checks.seat_checks import window_verdicts
from cad.checks.tip_checks import PLACE_TOLERANCE_MM
from cad.parts.assembly import turned_twin
from cad.parts.cover_solid import turn_cover
from cad.parts.part import is_hole
from cad.parts.pose import in_place
from cad.parts.sensor import SensorSolids
from sensor.design.processes import Process
from sensor.verdict import Verdict, at_least, equal, failed_verdict

PLATES_GAP_MM = 0.3  # plates that bow towards each other by half of it each, as thin prints do, still move freely
_TO_THE_STOP = (0.0, 0.5, 1.0)  # fractions of the way


def cover_verdicts(sensor: SensorSolids, cover: cq.Shape, process: Process) -> tuple[Verdict, ...]:
    """Return geometry.cover_clearance, _holes and _over_fruit [mm] of a back cover, made or read, and its turned copy.

    A Hall read-out adds geometry.sensor_windows [mm]. Clearance is the least distance of a cover from shuttles, necks
    and leaves, at rest, half way and at their stops. A plate of a square has a cover on its front alone.
    """
    covers = {} if sensor.housing.back_to_back else {"back": cover}
    covers["front"] = turn_cover(cover, sensor.housing)
    pairs = {}
    for pose, arm in _arm_poses(sensor):
        for side, shape in covers.items():
            pairs[f"{side}, {pose}"] = (arm, shape)
    nearest, distance = nearest_pair(pairs)
    clearance = at_least(
        "geometry.cover_clearance",
        distance,
        process.min_gap_mm,
        PLACE_TOLERANCE_MM,
        unit="mm",
        reference=f"least distance of what moves from a cover: {nearest}; {process.name}",
    )
    both = cq.Compound.makeCompound(list(covers.values()))
    over_fruit = fruit_clearance_verdict("geometry.cover_over_fruit", sensor, both)
    return clearance, _cover_holes(sensor, covers), over_fruit, *window_verdicts(sensor, covers["front"])


def _arm_poses(sensor: SensorSolids) -> list[tuple[str, cq.Shape]]:
    """Return the arms moved as a whole towards their stops, which is farther than any leaf of them goes."""
    poses = []
    for arm in sensor.housing.arms:
        shape = moving_part(sensor, arm)
        stop = sensor.housing.cavity_level - arm.top_level
        for fraction in _TO_THE_STOP:
            moved = shape.translate(cq.Vector(0.0, 0.0, fraction * stop))
            poses.append((f"{arm.name} arm {100.0 * fraction:g} % of the way to the stop", moved))
    return poses


def _cover_holes(sensor: SensorSolids, covers: dict[str, cq.Shape]) -> Verdict:
    """Return how far a hole of a cover is off that of the housing: its axis, or its radius."""
    faces = sensor.part.shape.Faces()
    declared = hole_axes(faces[index] for index in sensor.part.faces["mounting_holes"])
    drilled = {}
    for side, shape in covers.items():
        round_faces = hole_axes(face for face in shape.Faces() if face.geomType() == "CYLINDER")
        drilled[f"the {side} cover"] = (round_faces, declared)
    return holes_verdict("geometry.cover_holes", drilled, "the housing's")


def plate_verdicts(sensor: SensorSolids) -> tuple[Verdict, ...]:
    """Return geometry.plates and geometry.plate_holes [mm] of the two plates of a square; none for another sensor.

    Plates that run into each other, or whose pads do not meet, fail. Else the value is the least distance of what moves
    in one plate, at rest, half way and at its stop, from the other.
    """
    if not sensor.housing.back_to_back:
        return ()
    return _plates(sensor), _plate_holes(sensor)


def _plates(sensor: SensorSolids) -> Verdict:
    """Return geometry.plates: failed where the plates overlap or do not meet, else the least distance of what moves."""
    name = "geometry.plates"
    plate = in_place(sensor.part.shape, sensor.housing)
    twin = turned_twin(plate)
    shared = sum(solid.Volume() for solid in plate.intersect(twin).Solids())
    if shared > 0.0:
        reference = f"the plates run into each other, {shared:.3g} mm^3 of them in the same place"
        return failed_verdict(name, PLATES_GAP_MM, unit="mm", reference=reference)
    _, apart = nearest_pair({name: (plate, twin)})
    if apart > PLACE_TOLERANCE_MM:
        reference = f"the pads of the plates do not meet: screws would bend the plates by {apart:.3g} mm"
        return failed_verdict(name, PLATES_GAP_MM, unit="mm", reference=reference)
    nearest, distance = nearest_pair({pose: (in_place(arm, sensor.housing), twin) for pose, arm in _arm_poses(sensor)})
    reference = f"plates meet at their pads; least distance of what moves in one from the other, {nearest}"
    return at_least(name, distance, PLATES_GAP_MM, PLACE_TOLERANCE_MM, unit="mm", reference=reference)


def _plate_holes(sensor: SensorSolids) -> Verdict:
    """Return how far a hole for a screw or a dowel is off that of the turned plate: its axis, or its radius."""
    housing = sensor.housing
    diameters = (housing.hole_diameter, housing.dowel_hole)
    drilled = hole_axes(face for face in sensor.part.shape.Faces() if any(is_hole(face, d) for d in diameters))
    of_twin = sorted((-x, z, radius) for x, z, radius in drilled)
    count = len(housing.holes) + len(housing.dowels)
    holes = {"a plate": (drilled, of_twin if len(drilled) == count else count * of_twin[:1])}
    return holes_verdict("geometry.plate_holes", holes, "the turned plate's")


HoleAxis = tuple[float, float, float]


def holes_verdict(name: str, holes: Mapping[str, tuple[list[HoleAxis], list[HoleAxis]]], whose: str) -> Verdict:
    """Return how far a hole is off [mm], its axis or radius; `holes` are by part those that it has and must have."""
    off = 0.0
    for part, (drilled, expected) in holes.items():
        if len(drilled) != len(expected):
            reference = f"{len(drilled)} holes in {part}: must be {len(expected)}"
            return failed_verdict(name, 0.0, unit="mm", reference=reference)
        off = max(off, float(np.abs(np.subtract(drilled, expected)).max()))
    reference = f"axes and radii of the holes in {' and '.join(holes)} against {whose}"
    return equal(name, off, 0.0, PLACE_TOLERANCE_MM, unit="mm", reference=reference)


def hole_axes(faces: Iterable[cq.Face], second_axis: str = "z") -> list[HoleAxis]:
    """Return x and z, or another second coordinate, of the axis and the radius of round holes [mm], in order."""
    axes = []
    for face in faces:
        box = face.BoundingBox()
        second = getattr(box.center, second_axis)
        axes.append((round(box.center.x, 6), round(second, 6), round(0.5 * box.xlen, 6)))
    return sorted(axes)
