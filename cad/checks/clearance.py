"""Distances that must stay open: frame and necks from the fruit at full travel, moving parts from their stops."""

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

STOP_SAFETY = 1.2  # a stop stands this much above the deflection at full travel
HEADINGS = tuple(22.5 * step for step in range(16))  # [deg] from the high tip round to the side +y
_REACH = 1.0  # [mm] beyond the plate, so that a cut leaves no skin
_CHORD_MM = 2e-3  # of triangles that tell which headings come near
_CHORD_ANGLE = 0.5  # rad
_ON_SHUTTLE = (0.02, 0.5, 0.98)  # places that are measured, as shares of its width
_ON_LEAF = (0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9)  # and of the length from the wall


def clearance_verdicts(sensor: SensorSolids) -> tuple[Verdict, ...]:
    """Return geometry.frame_clearance and geometry.neck_clearance [mm]: smallest distance from the fruit.

    The housing is lowered by the travel. The frame is tilted by 3 degrees, or the press's own tilt where that is more,
    in 16 directions. The necks are tilted by the press's own tilt. The fruit is taken undeformed: it gives way.
    """
    housing = sensor.housing
    low, high = housing.arms
    half = 0.5 * (housing.spacing + housing.shuttle_width)
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
    """Return the smallest distance [mm] from the fruit of a shape in the sensor that moves with the frame."""
    return _clearance(name, sensor, shape, largest_tilt(sensor.press))


def moving_part(sensor: SensorSolids, arm: Arm) -> cq.Shape:
    """Return shuttle, neck, tip and leaves of one spring, cut from its wall at the roots [mm]."""
    across = (min(arm.wall, 0.0), max(arm.wall, 0.0))
    box = box_through(sensor.housing.depth, across, (-_REACH, sensor.housing.cavity_level))
    pieces = sensor.part.shape.intersect(box)
    # The largest solid: the fillets of the cavity beside an arm stay with the frame.
    return max(pieces.Solids(), key=lambda solid: solid.Volume(), default=pieces)


def _clearance(name: str, sensor: SensorSolids, shape: cq.Shape, tilt: float) -> Verdict:
    """Return the smallest distance [mm] of a shape from the fruit at full travel, tilted by `tilt` [deg] any way."""
    travel = sensor.press.travel_mm
    fruit = sensor.fruit_box()
    above_fruit = shape.moved(cq.Location(cq.Vector(0.0, 0.0, sensor.housing.beyond_face)))
    distances = {}
    for heading in nearest_headings(above_fruit, fruit, travel, tilt) if tilt > 0.0 else (0.0,):
        distances[heading] = _signed_distance(above_fruit.moved(pressed_pose(travel, tilt, heading)), fruit)
    worst = min(distances, key=distances.__getitem__)
    pose = f"travel {travel:g} mm, tilt {tilt:g} deg any way"
    least = f"least where the side {worst:g} deg from +x goes down"
    reference = f"smallest distance to the undeformed fruit: {pose}, {least}"
    return judge(name, distances[worst], reference)


def nearest_headings(shape: cq.Shape, fruit: cq.Shape, travel: float, tilt: float) -> tuple[float, ...]:
    """Return the headings [deg] in which a shape may come nearest to a box, by the gaps of its triangles [mm].

    A triangle is off its face by a chord's height at most: headings whose gaps differ by no more than twice that are
    left to the kernel, and so are all where the triangles bound no body.
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
        gaps[heading] = body.transform(matrix).min_gap(box, of_corners.min() + _CHORD_MM)  # none is wider than this
    farthest = min(gaps.values()) + 2.0 * _CHORD_MM
    return tuple(heading for heading, gap in gaps.items() if gap <= farthest)


def _triangulated(shape: cq.Shape) -> tuple[Floats, NDArray[np.uint64]]:
    """Return the corners [mm] of the triangles of a shape, shape (n, 3), and their numbers, shape (m, 3)."""
    unmeshed = shape.copy()
    OCP.BRepMesh.BRepMesh_IncrementalMesh(unmeshed.wrapped, _CHORD_MM, isRelative=False, theAngDeflection=_CHORD_ANGLE)
    vertices, triangles = unmeshed.tessellate(_CHORD_MM, _CHORD_ANGLE)
    corners = np.array([vertex.toTuple() for vertex in vertices]).reshape(-1, 3)
    return corners, np.array(triangles, dtype=np.uint64).reshape(-1, 3)


def _bounded(corners: Floats, triangles: NDArray[np.uint64]) -> manifold3d.Manifold:
    """Return the body that triangles bound, with a status where they bound none."""
    mesh = manifold3d.Mesh64(corners, triangles)
    mesh.merge()
    return manifold3d.Manifold(mesh)


def _signed_distance(shape: cq.Shape, fruit: cq.Shape) -> float:
    """Return the distance of a shape from the fruit, or minus the depth to which it reaches below the fruit's top."""
    distance = shape.distance(fruit)
    if distance > 0.0:
        return float(distance)
    common = shape.intersect(fruit)
    return float(common.BoundingBox().zmin) if common.Solids() else 0.0


def stop_verdicts(sensor: SensorSolids, deflections: tuple[float, ...]) -> tuple[Verdict, ...]:
    """Return geometry.stops_low and _high: deflection [mm] at which shuttle or leaf first meets the frame.

    The deflections [mm] of low and high spring are those at full travel; a stop must stand 1.2 times above. With
    them geometry.deflected_gap_low and _high [mm]: what is left between leaf and frame when the shuttle is stopped.
    """
    lines = solid_lines(sensor.part.shape)
    verdicts: list[Verdict] = []
    for arm, deflection in zip(sensor.housing.arms, deflections, strict=True):
        verdicts += _arm_stop_verdicts(lines, sensor.housing, arm, deflection)
    return tuple(verdicts)


def _arm_stop_verdicts(lines: Lines, housing: Housing, arm: Arm, deflection: float) -> tuple[Verdict, Verdict]:
    """Return the verdicts on the stop of an arm beyond a deflection [mm], and on the gap above its leaf there.

    The frame stops the shuttle, or first a point of the leaf, which moves by a fraction of the shuttle's deflection. A
    guided leaf has the shape 3 s^2 - 2 s^3 over the fraction s of its length from the wall.
    """
    stops = f"geometry.stops_{arm.name}"
    gap = f"geometry.deflected_gap_{arm.name}"
    limit = STOP_SAFETY * deflection
    shuttle_stop = math.inf
    for fraction in _ON_SHUTTLE:
        x = arm.shuttle - arm.sign * fraction * housing.shuttle_width
        shuttle_stop = min(shuttle_stop, _gap_above(lines, (x, 0.0, housing.neck_level)))
    leaf_gaps = {}  # of points of the upper leaf, by how much of the shuttle's deflection they move
    for fraction in _ON_LEAF:
        moved = guided_share(fraction)
        x = arm.wall + fraction * (arm.shuttle - arm.wall)
        leaf_gaps[moved] = _gap_above(lines, (x, 0.0, arm.levels[1]))

    for blocked, open_distance in (("shuttle", shuttle_stop), ("leaf", max(leaf_gaps.values()))):
        if math.isinf(open_distance):
            reference = f"no stop: the {blocked} touches it already, or nothing is above"
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
    """Return the share of the shuttle's deflection that a guided leaf has at a share s of its length from the wall."""
    return 3.0 * s**2 - 2.0 * s**3


def _gap_above(lines: Lines, point: Vector) -> float:
    """Return the open distance above the material around a point [mm]; infinite where there is no such, or none above.

    A bar that touches the material is one with it.
    """
    spans = lines(point, UP)
    for here, above in itertools.pairwise(spans):
        if here.enter <= 0.0 <= here.leave:
            return above.enter - here.leave
    return math.inf
