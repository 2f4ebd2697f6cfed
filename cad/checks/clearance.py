"""Clearances: from frame and necks to the fruit at full travel, and from moving parts to their stops."""

import itertools
import math

import cadquery as cq
import manifold3d
import numpy as np
import OCP
from numpy.typing import NDArray

from cad.checks.line_probe import UP, Lines, Vector, solid_lines
from cad.parts.assembly import plate_places
from cad.parts.housing import Arm, Housing, largest_tilt, press_tilt
from cad.parts.part import box_through
from cad.parts.pose import location_matrix, pressed_pose
from cad.parts.sensor import SensorSolids
from sensor.arrays import Floats
from sensor.verdict import Verdict, judge

STOP_SAFETY = 1.2  # least deflection at a stop, over the deflection at full travel; a judgement
HEADINGS = tuple(22.5 * step for step in range(16))  # [deg] side that a tilt lowers, from +x towards +y
_REACH = 1.0  # [mm] extension of a cutting box beyond the plate, so that no thin skin remains
_CHORD_MM = 2e-3  # largest distance between a face and the triangles that preselect headings
_CHORD_ANGLE = 0.5  # rad
_ON_SHUTTLE = (0.02, 0.5, 0.98)  # measured places on a shuttle, as shares of its width
_ON_LEAF = (0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9)  # measured places on a leaf, as shares of its length from the wall


def clearance_verdicts(sensor: SensorSolids) -> tuple[Verdict, ...]:
    """Return geometry.frame_clearance and geometry.neck_clearance [mm]: the smallest distances from the fruit.

    The housing is lowered by the travel and tilted in 16 directions. The necks are tilted by the tilt of the press,
    the frame by at least 3 degrees. The fruit is undeformed, which is safe, because a pressed fruit recedes.
    """
    housing = sensor.housing
    low, high = housing.arms
    half = 0.5 * (housing.spacing + housing.shuttle_width)
    # A printed tip may touch the fruit, so the neck begins above it. The foot of a pin may not, so it is included.
    tip_height = housing.tip_height if housing.pin is None else 0.0
    moving = box_through(housing.depth, (low.wall, high.wall), (-_REACH, housing.cavity_level))
    frame = sensor.part.shape.cut(moving)
    necks = sensor.part.shape.intersect(box_through(housing.depth, (-half, half), (tip_height, housing.neck_level)))
    plate = plate_places(housing)[0]
    return (
        fruit_clearance_verdict("geometry.frame_clearance", sensor, frame.moved(plate)),
        _clearance("geometry.neck_clearance", sensor, necks.moved(plate), press_tilt(sensor.press)),
    )


def fruit_clearance_verdict(name: str, sensor: SensorSolids, shape: cq.Shape) -> Verdict:
    """Return the verdict on the distance [mm] from the fruit of a shape that moves with the frame.

    The shape is in the sensor frame. It is tilted like the frame in `clearance_verdicts`.
    """
    return _clearance(name, sensor, shape, largest_tilt(sensor.press))


def moving_part(sensor: SensorSolids, arm: Arm) -> cq.Shape:
    """Return shuttle, neck, tip and leaves of one spring, separated from the frame at the roots of the leaves [mm]."""
    across = (min(arm.wall, 0.0), max(arm.wall, 0.0))
    box = box_through(sensor.housing.depth, across, (-_REACH, sensor.housing.cavity_level))
    pieces = sensor.part.shape.intersect(box)
    # The box also cuts out fillets of the cavity, which belong to the frame; the arm is the largest solid.
    return max(pieces.Solids(), key=lambda solid: solid.Volume(), default=pieces)


def _clearance(name: str, sensor: SensorSolids, shape: cq.Shape, tilt: float) -> Verdict:
    """Return the verdict on the smallest distance [mm] of a shape from the fruit at full travel.

    The shape is tilted by `tilt` [deg] in every heading.
    """
    travel = sensor.press.travel_mm
    fruit = sensor.fruit_box()
    above_fruit = shape.moved(cq.Location(cq.Vector(0.0, 0.0, sensor.housing.beyond_face)))
    distances = {}
    for heading in nearest_headings(above_fruit, fruit, travel, tilt) if tilt > 0.0 else (0.0,):
        distances[heading] = _signed_distance(above_fruit.moved(pressed_pose(travel, tilt, heading)), fruit)
    worst = min(distances, key=distances.__getitem__)
    pose = f"travel {travel:g} mm, tilt {tilt:g} deg in any direction"
    least = f"least if the tilt lowers the side at {worst:g} deg from +x"
    reference = f"smallest distance to the undeformed fruit: {pose}, {least}"
    return judge(name, distances[worst], reference)


def nearest_headings(shape: cq.Shape, fruit: cq.Shape, travel: float, tilt: float) -> tuple[float, ...]:
    """Return the headings [deg] in which a shape may come nearest to the box of a fruit.

    The kernel measures a distance slowly, so the gaps [mm] of triangles preselect headings. A triangle deviates from
    its face by at most `_CHORD_MM`. A heading is kept if its gap exceeds the least gap by no more than twice this
    deviation. All headings are kept if the triangles do not bound a body.
    """
    corners, triangles = _triangulated(shape)
    body = _bounded(corners, triangles)
    box = _bounded(*_triangulated(fruit))
    if body.status() != manifold3d.Error.NoError or body.is_empty():
        return HEADINGS
    bounds = np.reshape(box.bounding_box(), (2, 3))
    gaps = {}
    for heading in HEADINGS:
        matrix = location_matrix(pressed_pose(travel, tilt, heading))
        posed = corners @ matrix[:, :3].T + matrix[:, 3]
        of_corners = np.linalg.norm(np.maximum(0.0, np.maximum(bounds[0] - posed, posed - bounds[1])), axis=1)
        # The nearest corner bounds the gap from above, and manifold searches only within such a bound.
        gaps[heading] = body.transform(matrix).min_gap(box, of_corners.min() + _CHORD_MM)
    farthest = min(gaps.values()) + 2.0 * _CHORD_MM
    return tuple(heading for heading, gap in gaps.items() if gap <= farthest)


def _triangulated(shape: cq.Shape) -> tuple[Floats, NDArray[np.uint64]]:
    """Return the corners [mm] of the triangles of a shape, (n, 3), and the corner numbers of each triangle, (m, 3)."""
    unmeshed = shape.copy()
    OCP.BRepMesh.BRepMesh_IncrementalMesh(unmeshed.wrapped, _CHORD_MM, isRelative=False, theAngDeflection=_CHORD_ANGLE)
    vertices, triangles = unmeshed.tessellate(_CHORD_MM, _CHORD_ANGLE)
    corners = np.array([vertex.toTuple() for vertex in vertices]).reshape(-1, 3)
    return corners, np.array(triangles, dtype=np.uint64).reshape(-1, 3)


def _bounded(corners: Floats, triangles: NDArray[np.uint64]) -> manifold3d.Manifold:
    """Return the body that triangles bound; its status is an error if they bound none."""
    mesh = manifold3d.Mesh64(corners, triangles)
    mesh.merge()
    return manifold3d.Manifold(mesh)


def _signed_distance(shape: cq.Shape, fruit: cq.Shape) -> float:
    """Return the distance of a shape from the fruit [mm], negative if the shape enters the fruit.

    A negative value is the level of its lowest point in the fruit, whose top is at 0.
    """
    distance = shape.distance(fruit)
    if distance > 0.0:
        return float(distance)
    common = shape.intersect(fruit)
    return float(common.BoundingBox().zmin) if common.Solids() else 0.0


def stop_verdicts(sensor: SensorSolids, deflections: tuple[float, ...]) -> tuple[Verdict, ...]:
    """Return geometry.stops_* and geometry.deflected_gap_* [mm] for the low and the high arm.

    The first is the deflection at which shuttle or leaf first meets the frame. It must be at least 1.2 times the
    deflection at full travel, which `deflections` [mm] holds for low and high spring. The second is the gap that
    remains between leaf and frame when the shuttle is at its stop.
    """
    lines = solid_lines(sensor.part.shape)
    verdicts: list[Verdict] = []
    for arm, deflection in zip(sensor.housing.arms, deflections, strict=True):
        verdicts += _arm_stop_verdicts(lines, sensor.housing, arm, deflection)
    return tuple(verdicts)


def _arm_stop_verdicts(lines: Lines, housing: Housing, arm: Arm, deflection: float) -> tuple[Verdict, Verdict]:
    """Return the verdicts on the stop of an arm and on the gap above its leaf at the stop.

    `deflection` [mm] is the deflection of the shuttle at full travel. The frame stops the shuttle or a point of the
    leaf, whichever meets it first. A point of the leaf moves by `guided_share` of the deflection of the shuttle.
    """
    stops = f"geometry.stops_{arm.name}"
    gap = f"geometry.deflected_gap_{arm.name}"
    limit = STOP_SAFETY * deflection
    shuttle_stop = math.inf
    for fraction in _ON_SHUTTLE:
        x = arm.shuttle - arm.sign * fraction * housing.shuttle_width
        shuttle_stop = min(shuttle_stop, _gap_above(lines, (x, 0.0, housing.neck_level)))
    leaf_gaps = {}  # gaps [mm] above points of the upper leaf, by their share of the deflection of the shuttle
    for fraction in _ON_LEAF:
        moved = guided_share(fraction)
        x = arm.wall + fraction * (arm.shuttle - arm.wall)
        leaf_gaps[moved] = _gap_above(lines, (x, 0.0, arm.levels[1]))

    for blocked, open_distance in (("shuttle", shuttle_stop), ("leaf", max(leaf_gaps.values()))):
        if math.isinf(open_distance):
            reference = f"no stop: the {blocked} already touches the frame, or nothing is above it"
            return judge(stops, None, reference, limit=limit), judge(gap, None, reference)

    leaf_stop = min(open_distance / moved for moved, open_distance in leaf_gaps.items())
    first = "shuttle" if shuttle_stop <= leaf_stop else "leaf"
    least = f"{STOP_SAFETY:g} x {deflection:.4g} mm at full travel"
    reference = f"lines from shuttle and leaf to the frame; limit is {least}; the {first} touches first"
    stop = judge(stops, min(shuttle_stop, leaf_stop), reference, limit=limit)
    left = min(open_distance - shuttle_stop * moved for moved, open_distance in leaf_gaps.items())
    reference = f"least distance between leaf and frame with the shuttle at its stop, {shuttle_stop:.4g} mm up"
    return stop, judge(gap, left, reference)


def guided_share(s: float) -> float:
    """Return the deflection of a guided leaf over the deflection of its shuttle [1], at the share s of its length.

    `s` is measured from the wall. This is the cubic of a beam between two ends that do not rotate.
    """
    return 3.0 * s**2 - 2.0 * s**3


def _gap_above(lines: Lines, point: Vector) -> float:
    """Return the open distance above the material around a point [mm].

    It is infinite if the point is outside the material or nothing is above it. A second body that touches the material
    is treated as one with it.
    """
    spans = lines(point, UP)
    for here, above in itertools.pairwise(spans):
        if here.enter <= 0.0 <= here.leave:
            return above.enter - here.leave
    return math.inf
