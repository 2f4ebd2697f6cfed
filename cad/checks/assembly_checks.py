"""Verdicts on assembled parts: a cover on its housing, and the two back-to-back plates of a square of tips."""

import cadquery as cq

from cad.checks.clearance import fruit_clearance_verdict, moving_part
from cad.checks.near_faces import PLACE_TOLERANCE_MM, nearest_pair
from cad.checks.seat_checks import window_verdicts
from cad.parts.assembly import cover_locations, plate_locations
from cad.parts.sensor import SensorSolids
from sensor.design.processes import Process
from sensor.verdict import Verdict, judge

_STOP_FRACTIONS = (0.0, 0.5, 1.0)  # positions at which an arm is measured, as fractions of its distance to the stop


def cover_verdicts(sensor: SensorSolids, cover: cq.Shape, process: Process) -> tuple[Verdict, ...]:
    """Return geometry.cover_clearance and geometry.cover_over_fruit [mm] for the covers on both faces of a housing.

    `cover` is placed as the back cover, and a rotated copy as the front cover. The clearance is the smallest distance
    between a cover and the shuttles, necks and leaves. Each arm is measured at rest, halfway to its stop, and at its
    stop. The clearance must be at least the smallest gap that `process` can print. With a Hall read-out,
    geometry.sensor_windows [mm] is returned too.
    """
    front_place, back_place = cover_locations(sensor.housing)
    # Two back-to-back plates have no cover between them. Only the front cover of the first plate is checked, because
    # the second plate is a rotated copy.
    covers = {} if sensor.housing.back_to_back else {"back": cover.moved(back_place)}
    covers["front"] = cover.moved(front_place)
    pairs = {}  # each arm in each pose with each cover
    for pose, arm in _arm_poses(sensor):
        for side, placed_cover in covers.items():
            pairs[f"{side}, {pose}"] = (arm, placed_cover)
    nearest_name, distance = nearest_pair(pairs)
    reference = f"smallest distance between a cover and the moving parts: {nearest_name}; {process.name}"
    clearance = judge(
        "geometry.cover_clearance", distance, reference, limit=process.min_gap_mm, tolerance=PLACE_TOLERANCE_MM
    )
    all_covers = cq.Compound.makeCompound(list(covers.values()))
    over_fruit = fruit_clearance_verdict("geometry.cover_over_fruit", sensor, all_covers)
    return clearance, over_fruit, *window_verdicts(sensor)


def _arm_poses(sensor: SensorSolids) -> list[tuple[str, cq.Shape]]:
    """Return each arm at rest, halfway to its stop, and at its stop, as pairs of a name and a placed shape [mm].

    An arm is moved as a rigid body. The leaves of the arm then move farther than they would in bending, which is
    conservative. Of two back-to-back plates, only the first is measured, because the second is a rotated copy of it.
    """
    placement = plate_locations(sensor.housing)[0]
    poses = []
    for arm in sensor.housing.arms:
        shape = moving_part(sensor, arm)
        stop_distance = sensor.housing.cavity_level - arm.top_level
        for fraction in _STOP_FRACTIONS:
            moved_arm = shape.moved(placement * cq.Location(cq.Vector(0.0, 0.0, fraction * stop_distance)))
            poses.append((f"{arm.name} arm {100.0 * fraction:g} % of the way to the stop", moved_arm))
    return poses


def plate_verdicts(sensor: SensorSolids) -> tuple[Verdict, ...]:
    """Return geometry.plates [mm] for two back-to-back plates, or an empty tuple for a sensor with one plate.

    The verdict fails if the plates intersect or their pads do not meet. Otherwise, the value of the verdict is the
    smallest distance between the moving parts of one plate and the other plate. Each moving part is measured at rest,
    halfway to its stop, and at its stop.
    """
    if not sensor.housing.back_to_back:
        return ()
    verdict_name = "geometry.plates"
    plate, other_plate = (sensor.part.shape.moved(placement) for placement in plate_locations(sensor.housing))
    common_volume = sum(solid.Volume() for solid in plate.intersect(other_plate).Solids())
    if common_volume > 0.0:
        reference = f"the plates intersect in a volume of {common_volume:.3g} mm^3"
        return (judge(verdict_name, None, reference),)
    # The plates are closest to each other at their pads.
    _, pad_gap = nearest_pair({"plates": (plate, other_plate)})
    if pad_gap > PLACE_TOLERANCE_MM:
        reference = f"the pads of the plates do not touch: screws would bend the plates by {pad_gap:.3g} mm"
        return (judge(verdict_name, None, reference),)
    pairs = {pose: (arm, other_plate) for pose, arm in _arm_poses(sensor)}
    nearest_name, distance = nearest_pair(pairs)
    reference = (
        f"the pads of the plates touch; smallest distance between the moving parts of one and the other: {nearest_name}"
    )
    return (judge(verdict_name, distance, reference, tolerance=PLACE_TOLERANCE_MM),)
