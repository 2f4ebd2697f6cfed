"""Verdicts on clearances: from frame and necks to the fruit at full travel, and from moving parts to their stops."""

import itertools
import math

import cadquery as cq
import manifold3d
import numpy as np
import OCP
from numpy.typing import NDArray

from cad.checks.line_probe import UP, LineProbe, Vector, solid_probe
from cad.parts.assembly import plate_locations
from cad.parts.housing import Arm, Housing, largest_tilt, press_tilt
from cad.parts.layout import STOP_SAFETY
from cad.parts.part import box_through
from cad.parts.pose import location_matrix, pressed_pose
from cad.parts.sensor import SensorSolids
from sensor.arrays import Floats
from sensor.verdict import Verdict, judge

HEADINGS = tuple(22.5 * step for step in range(16))  # [deg] directions in which the sensor tilts, from +x towards +y
_MARGIN_MM = 1.0  # distance by which a cutting box extends beyond the plate, so that no thin layer remains
# Largest distance between a face and its triangles, which are used for a first selection of tilt directions.
_CHORD_MM = 2e-3
_CHORD_ANGLE_RAD = 0.5  # largest angle between neighbouring triangles of a face
_SHUTTLE_FRACTIONS = (0.02, 0.5, 0.98)  # measured points on a shuttle, as fractions of its width
_LEAF_FRACTIONS = (0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9)  # measured points on a leaf, as fractions of its length


def clearance_verdicts(sensor: SensorSolids) -> tuple[Verdict, ...]:
    """Return geometry.frame_clearance and geometry.neck_clearance: the smallest distances from the fruit [mm].

    The housing is lowered by the travel and tilted in 16 directions. The necks are tilted by the tilt of the press, and
    the frame by at least 3 degrees. The fruit is assumed to be undeformed. This assumption is conservative, because
    pressed fruit recedes.
    """
    housing = sensor.housing
    low, high = housing.arms
    # The arms are inside this box, between their walls and below the top of the cavity. The frame remains if the box is
    # cut away.
    arm_box = box_through(housing.depth, (low.wall, high.wall), (-_MARGIN_MM, housing.cavity_level))
    frame = sensor.part.shape.cut(arm_box)
    necks = _cut_out_necks(sensor)
    # A second plate is a copy, rotated by half a turn about the press axis, and has the same clearances.
    placement = plate_locations(housing)[0]
    return (
        fruit_clearance_verdict("geometry.frame_clearance", sensor, frame.moved(placement)),
        _clearance_verdict("geometry.neck_clearance", sensor, necks.moved(placement), press_tilt(sensor.press)),
    )


def _cut_out_necks(sensor: SensorSolids) -> cq.Shape:
    """Return the necks of both shuttles [mm].

    A printed tip may touch the fruit, so it is not included. The foot of a pin must not touch the fruit, so it is
    included.
    """
    housing = sensor.housing
    half_width = 0.5 * (housing.spacing + housing.shuttle_width)  # from x = 0 to the outer side of a shuttle
    lower_level = housing.tip_height if housing.pin is None else 0.0
    neck_box = box_through(housing.depth, (-half_width, half_width), (lower_level, housing.neck_level))
    return sensor.part.shape.intersect(neck_box)


def fruit_clearance_verdict(name: str, sensor: SensorSolids, shape: cq.Shape) -> Verdict:
    """Return the verdict on the distance [mm] between the fruit and a shape that moves with the frame, such as a cover.

    `shape` is in sensor coordinates. The shape is lowered by the travel, and tilted by the largest tilt of the frame.
    """
    return _clearance_verdict(name, sensor, shape, largest_tilt(sensor.press))


def moving_part(sensor: SensorSolids, arm: Arm) -> cq.Shape:
    """Return the moving part of one spring [mm]: its shuttle, neck, tip and leaves, cut off at the leaf roots."""
    # The arm lies between its wall and the plane x = 0 midway between the tips.
    x_range = (min(arm.wall, 0.0), max(arm.wall, 0.0))
    box = box_through(sensor.housing.depth, x_range, (-_MARGIN_MM, sensor.housing.cavity_level))
    pieces = sensor.part.shape.intersect(box)
    # The box also cuts off fillets of the cavity, which belong to the frame. The arm is the largest of the solids. If
    # there is no solid in the box, the empty intersection is returned.
    return max(pieces.Solids(), key=lambda solid: solid.Volume(), default=pieces)


def _clearance_verdict(name: str, sensor: SensorSolids, shape: cq.Shape, tilt: float) -> Verdict:
    """Return the verdict on the smallest distance [mm] between a shape and the fruit at full travel.

    `shape` is in the coordinates of the sensor [mm]. The shape is tilted by `tilt` [deg]. Of the directions in
    `HEADINGS`, only those are measured in which it may come closest to the fruit.
    """
    travel = sensor.press.travel_mm
    fruit = sensor.fruit_box()
    # Pins protrude below z = 0. The sensor is raised, so that their ends are at z = 0, where the top of the fruit is.
    touching_shape = shape.moved(cq.Location(cq.Vector(0.0, 0.0, sensor.housing.beyond_face)))
    headings: tuple[float, ...] = (0.0,)  # without a tilt, the heading has no effect
    if tilt > 0.0:
        headings = nearest_headings(touching_shape, fruit, travel, tilt)
    distances = {}
    for heading in headings:
        pressed_shape = touching_shape.moved(pressed_pose(travel, tilt, heading))
        distances[heading] = _signed_distance(pressed_shape, fruit)
    worst = min(distances, key=distances.__getitem__)
    pose = f"travel {travel:g} mm, tilt {tilt:g} deg in any direction"
    direction = f"smallest if the tilt lowers the side at {worst:g} deg from +x"
    reference = f"distance from the undeformed fruit: {pose}, {direction}"
    return judge(name, distances[worst], reference)


def nearest_headings(shape: cq.Shape, fruit: cq.Shape, travel: float, tilt: float) -> tuple[float, ...]:
    """Return the headings [deg] in which a tilted shape may come closest to the box of a fruit.

    `shape` is lowered by `travel` [mm] from the first touch, and tilted by `tilt` [deg] towards each heading. The CAD
    kernel measures distances slowly, so headings are preselected by the gaps between triangles. A triangle deviates
    from its face by at most `_CHORD_MM`. Therefore a heading is kept if its gap exceeds the smallest gap by at most
    twice this deviation. All headings are kept if the triangles do not enclose a body.
    """
    corners, triangles = _triangulate(shape)
    body = _enclosed_body(corners, triangles)
    box = _enclosed_body(*_triangulate(fruit))
    if body.status() != manifold3d.Error.NoError or body.is_empty():
        return HEADINGS
    bounds = np.reshape(box.bounding_box(), (2, 3))  # smallest and largest x, y and z of the box of the fruit
    gaps = {}
    for heading in HEADINGS:
        matrix = location_matrix(pressed_pose(travel, tilt, heading))  # (3, 4): the rotation, and the translation last
        posed_corners = corners @ matrix[:, :3].T + matrix[:, 3]
        corner_distances = _distances_from_box(posed_corners, bounds)
        # The distance of the nearest corner is an upper bound on the gap, so manifold3d need not search beyond it. The
        # chord is added as a margin for round-off.
        gaps[heading] = body.transform(matrix).min_gap(box, corner_distances.min() + _CHORD_MM)
    gap_limit = min(gaps.values()) + 2.0 * _CHORD_MM
    return tuple(heading for heading, gap in gaps.items() if gap <= gap_limit)


def _distances_from_box(points: Floats, bounds: Floats) -> Floats:
    """Return the distance [mm] of each point (n, 3) from a box, shape (n,); it is 0 inside the box.

    `bounds` (2, 3) are the smallest and the largest x, y and z of the box.
    """
    # Along each axis, a point is outside the box by its distance from the nearer bound, or by 0 between both.
    outside = np.maximum(0.0, np.maximum(bounds[0] - points, points - bounds[1]))
    return np.asarray(np.linalg.norm(outside, axis=1))


def _triangulate(shape: cq.Shape) -> tuple[Floats, NDArray[np.uint64]]:
    """Return a triangulation of a shape: its corners (n, 3) [mm], and the corner indices of each triangle (m, 3)."""
    # The CAD kernel OCCT stores triangles in the shape, and would reuse an earlier, coarser triangulation. The copy has
    # no triangles.
    copy = shape.copy()
    OCP.BRepMesh.BRepMesh_IncrementalMesh(copy.wrapped, _CHORD_MM, isRelative=False, theAngDeflection=_CHORD_ANGLE_RAD)
    vertices, triangles = copy.tessellate(_CHORD_MM, _CHORD_ANGLE_RAD)
    corners = np.array([vertex.toTuple() for vertex in vertices]).reshape(-1, 3)
    return corners, np.array(triangles, dtype=np.uint64).reshape(-1, 3)


def _enclosed_body(corners: Floats, triangles: NDArray[np.uint64]) -> manifold3d.Manifold:
    """Return the body that triangles enclose. Its status is an error if the triangles do not enclose a body.

    `corners` (n, 3) [mm] are the corners, and `triangles` (m, 3) holds the corner indices of each triangle.
    """
    mesh = manifold3d.Mesh64(corners, triangles)
    mesh.merge()  # joins the faces, each of which has its own copies of the corners on its edges
    return manifold3d.Manifold(mesh)


def _signed_distance(shape: cq.Shape, fruit: cq.Shape) -> float:
    """Return the distance between a shape and the fruit [mm]; it is negative if the shape enters the fruit.

    A negative value is the height z of the lowest point of their intersection. The top of the fruit is at z = 0.
    """
    distance = shape.distance(fruit)
    if distance > 0.0:
        return float(distance)
    intersection = shape.intersect(fruit)
    return float(intersection.BoundingBox().zmin) if intersection.Solids() else 0.0


def stop_verdicts(sensor: SensorSolids, deflections: tuple[float, ...]) -> tuple[Verdict, ...]:
    """Return geometry.stops_* and geometry.deflected_gap_* [mm] for the low and the high spring.

    The value of geometry.stops_* is the deflection at which the shuttle or a leaf first meets the frame. This
    deflection must be at least 1.2 times the deflection at full travel. `deflections` holds the deflection at full
    travel [mm] for the low and the high spring. The value of geometry.deflected_gap_* is the gap that remains between
    leaf and frame when the shuttle is at its stop.
    """
    probe = solid_probe(sensor.part.shape)
    verdicts: list[Verdict] = []
    for arm, deflection in zip(sensor.housing.arms, deflections, strict=True):
        verdicts += _arm_stop_verdicts(probe, sensor.housing, arm, deflection)
    return tuple(verdicts)


def _arm_stop_verdicts(probe: LineProbe, housing: Housing, arm: Arm, deflection: float) -> tuple[Verdict, Verdict]:
    """Return the verdicts on the stop of an arm and on the gap above its upper leaf at the stop.

    `probe` returns the chords of a line through the part, and `deflection` [mm] is the deflection of the shuttle at
    full travel. The frame stops the shuttle or a point of the leaf, whichever meets it first. If the shuttle deflects
    by d, a point at the fraction s of the leaf length deflects by `guided_leaf_shape`(s) d. So a gap g above this point
    stops the arm at d = g / `guided_leaf_shape`(s).
    """
    stop_name = f"geometry.stops_{arm.name}"
    gap_name = f"geometry.deflected_gap_{arm.name}"
    limit = STOP_SAFETY * deflection
    shuttle_stop = _gap_above_shuttle(probe, housing, arm)
    leaf_gaps = _gaps_above_leaf(probe, arm)  # keyed by `guided_leaf_shape` of the point below the gap
    # Neither verdict has a value if the gap is infinite above the whole shuttle, or above any point of the leaf.
    for member, gap in (("shuttle", shuttle_stop), ("leaf", max(leaf_gaps.values()))):
        if math.isinf(gap):
            reference = f"no stop: the {member} already touches the frame, or nothing is above it"
            return judge(stop_name, None, reference, limit=limit), judge(gap_name, None, reference)

    leaf_stop = min(gap / deflection_ratio for deflection_ratio, gap in leaf_gaps.items())
    first_member = "shuttle" if shuttle_stop <= leaf_stop else "leaf"
    limit_text = f"{STOP_SAFETY:g} x {deflection:.4g} mm at full travel"
    stop_text = f"lines from shuttle and leaf to the frame; limit is {limit_text}; the {first_member} touches first"
    stop = judge(stop_name, min(shuttle_stop, leaf_stop), stop_text, limit=limit)
    # With the shuttle at its stop, each point of the leaf has closed its gap by the deflection of this point.
    smallest_gap = min(gap - shuttle_stop * deflection_ratio for deflection_ratio, gap in leaf_gaps.items())
    gap_text = f"smallest distance between leaf and frame with the shuttle at its stop, {shuttle_stop:.4g} mm up"
    return stop, judge(gap_name, smallest_gap, gap_text)


def _gap_above_shuttle(probe: LineProbe, housing: Housing, arm: Arm) -> float:
    """Return the smallest gap [mm] above the shuttle of an arm; it is infinite if no measured point has a gap."""
    smallest = math.inf
    for fraction in _SHUTTLE_FRACTIONS:
        # The shuttle extends from the roots of its leaves towards x = 0; `arm.sign` is -1 for the left arm, and 1 for
        # the right arm.
        x = arm.shuttle - arm.sign * fraction * housing.shuttle_width
        smallest = min(smallest, _gap_above(probe, (x, 0.0, housing.neck_level)))
    return smallest


def _gaps_above_leaf(probe: LineProbe, arm: Arm) -> dict[float, float]:
    """Return the gap [mm] above each measured point of the upper leaf of an arm.

    The keys are the deflections of these points, divided by the deflection of the shuttle [1].
    """
    _, upper_level = arm.levels
    gaps = {}
    for fraction in _LEAF_FRACTIONS:
        x = arm.wall + fraction * (arm.shuttle - arm.wall)
        gaps[guided_leaf_shape(fraction)] = _gap_above(probe, (x, 0.0, upper_level))
    return gaps


def guided_leaf_shape(s: float) -> float:
    """Return the deflection of a point of a guided leaf, divided by the deflection of its shuttle [1].

    `s` [1] is the distance of the point from the wall, divided by the length of the leaf. The cubic 3 s^2 - 2 s^3 is
    the deflection curve of a beam whose ends do not rotate.
    """
    return 3.0 * s**2 - 2.0 * s**3


def _gap_above(probe: LineProbe, point: Vector) -> float:
    """Return the gap [mm] between the material around a point and the next material above it.

    The gap is infinite if the point is outside the material, or if there is no material above it. A second body that
    touches the material is treated as part of it.
    """
    # Positions on the line are measured from the point, so the material around the point contains the position 0.
    chords = probe(point, UP)
    for material, next_material in itertools.pairwise(chords):
        if material.enter <= 0.0 <= material.leave:
            return next_material.enter - material.leave
    return math.inf
