"""Distances that must stay open: frame and necks from the fruit at full travel, moving parts from their stops."""

import math

import cadquery as cq

from cad.checks.line_probe import SolidLines, Vector
from cad.design.parameters import Press
from cad.parts.housing import Housing
from cad.parts.layout import TILT_DEG
from cad.parts.sensor import Sensor, pressed
from cad.theory.flexure import Flexure
from cad.verdict import Verdict, at_least, failed

LEAF_GAP_MM = 0.1  # a leaf printed this much off its place still moves freely
STOP_SAFETY = 1.2  # a stop stands this much above the deflection at full travel
_HEADINGS = tuple(22.5 * step for step in range(16))  # [deg] from the high tip round to the side +y
_UP: Vector = (0.0, 0.0, 1.0)
_REACH = 1.0  # [mm] beyond the plate, so that a cut leaves no skin


def clearance_findings(sensor: Sensor) -> tuple[Verdict, ...]:
    """Return geometry.frame_clearance and geometry.neck_clearance [mm]: smallest distance from the fruit.

    The housing is lowered by the travel. The frame is tilted by 3 degrees, or the press's own tilt where that is
    more, in 16 directions, the necks by the press's own tilt. The fruit is taken undeformed: it gives way.
    """
    housing, own = sensor.housing, _tilt(sensor.press)
    frame, necks = sensor.part.shape.cut(_inside(housing)), sensor.part.shape.cut(_outside_necks(housing))
    return (
        fruit_finding("geometry.frame_clearance", sensor, frame),
        _finding("geometry.neck_clearance", sensor, necks, own),
    )


def fruit_finding(name: str, sensor: Sensor, shape: cq.Shape) -> Verdict:
    """Return the smallest distance [mm] of a shape that is fixed to the frame from the fruit, as of the frame."""
    return _finding(name, sensor, shape, steepest(sensor.press))


def steepest(press: Press) -> float:
    """Return the largest tilt [deg] in which the frame must clear the fruit."""
    return max(TILT_DEG, _tilt(press))


def moving_parts(sensor: Sensor) -> tuple[cq.Shape, cq.Shape]:
    """Return shuttle, neck, tip and leaves of the low and of the high spring, cut from the walls at the roots [mm]."""
    shape, housing = sensor.part.shape, sensor.housing
    low, high = (
        shape.intersect(_box((min(wall, 0.0), max(wall, 0.0)), housing, (-_REACH, housing.cavity_level)))
        for _, _, (wall, _) in housing.arms
    )
    return _largest(low), _largest(high)


def _largest(shape: cq.Shape) -> cq.Shape:
    """Return the largest solid of a shape: the fillets of the cavity beside an arm stay with the frame."""
    return max(shape.Solids(), key=lambda solid: solid.Volume(), default=shape)


def _tilt(press: Press) -> float:
    """Return the angle [deg] between the press and the normal of the fruit, from tilt and roll."""
    tilt, roll = math.radians(press.tilt_deg), math.radians(press.roll_deg)
    return math.degrees(math.acos(math.cos(tilt) * math.cos(roll)))


def _finding(name: str, sensor: Sensor, shape: cq.Shape, tilt: float) -> Verdict:
    pose = f"travel {sensor.press.travel_mm:g} mm, tilt {tilt:g} deg any way"
    fruit, shape = sensor.fruit_box(), shape.translate(cq.Vector(0.0, 0.0, sensor.housing.pin_out))
    headings = _HEADINGS if tilt > 0.0 else (0.0,)
    moved = (pressed(shape, sensor.press.travel_mm, tilt, heading) for heading in headings)
    distances = [_signed_distance(each, fruit) for each in moved]
    worst = min(distances)
    least = f"least where the side {headings[distances.index(worst)]:g} deg from +x goes down"
    reference = f"smallest distance to the undeformed fruit: {pose}, {least}"
    return at_least(name, worst, 0.0, 0.0, unit="mm", reference=reference)


def _signed_distance(shape: cq.Shape, fruit: cq.Solid) -> float:
    """Return the distance of a shape from the fruit, or minus the depth to which it reaches below the fruit's top."""
    distance = shape.distance(fruit)
    if distance > 0.0:
        return float(distance)
    common = shape.intersect(fruit)
    return float(common.BoundingBox().zmin) if common.Solids() else 0.0


def _inside(housing: Housing) -> cq.Shape:
    """Return the box that holds all that moves: shuttles, necks, tips and leaves."""
    start, end = housing.low_root[0], housing.high_root[0]
    return _box((start, end), housing, (-_REACH, housing.cavity_level))


def _outside_necks(housing: Housing) -> cq.Shape:
    """Return all but the necks between the tips and the level of the lower leaves."""
    half = 0.5 * (housing.spacing + housing.shuttle_width)
    far = max(abs(housing.left), abs(housing.right)) + _REACH
    tips = _box((-far, far), housing, (-_REACH, 0.0 if housing.pin_side else housing.tip_height))
    above = _box((-far, far), housing, (housing.neck_level, housing.top_level + _REACH))
    left, right = (_box(pair, housing, (-_REACH, housing.top_level)) for pair in ((-far, -half), (half, far)))
    return tips.fuse(above, left, right)


def _box(x: tuple[float, float], housing: Housing, z: tuple[float, float]) -> cq.Shape:
    depth = housing.depth + 2.0 * _REACH
    return cq.Solid.makeBox(x[1] - x[0], depth, z[1] - z[0], cq.Vector(x[0], -0.5 * depth, z[0]))


def stop_findings(sensor: Sensor, deflections: tuple[float, float]) -> tuple[Verdict, ...]:
    """Return geometry.stops_low and _high: deflection [mm] at which shuttle or leaf first meets the frame.

    The deflections [mm] of low and high spring are those at full travel; a stop must stand 1.2 times above. With
    them geometry.deflected_gap_low and _high [mm]: what is left between leaf and frame when the shuttle is stopped.
    """
    housing, lines = sensor.housing, SolidLines(sensor.part.shape)
    found: list[Verdict] = []
    for (side, flexure, roots), deflection in zip(housing.arms, deflections, strict=True):
        shuttle, leaf = _gaps(housing, lines, flexure, roots)
        found += _stop_findings(side, deflection, min(shuttle), leaf)
    return tuple(found)


def _stop_findings(side: str, deflection: float, stop: float, leaf: dict[float, float]) -> tuple[Verdict, Verdict]:
    """Return the two findings on one arm from the way of its shuttle to the stop and the ways of its leaf [mm]."""
    touch, names = min(leaf.values()), (f"geometry.stops_{side}", f"geometry.deflected_gap_{side}")
    limit = STOP_SAFETY * deflection
    for place, ways in (("shuttle", (stop,)), ("leaf", tuple(leaf.values()))):
        if not all(math.isfinite(way) for way in ways):
            reference = f"no stop: the {place} touches it already, or nothing is above"
            return failed(names[0], limit, unit="mm", reference=reference), failed(
                names[1], LEAF_GAP_MM, unit="mm", reference=reference
            )
    first = "shuttle" if stop <= touch else "leaf"
    least = f"{STOP_SAFETY:g} x {deflection:.4g} mm at full travel"
    stopped = f"lines from shuttle and leaf to the frame; limit is {least}; the {first} touches first"
    left = min((way - stop) * moved for moved, way in leaf.items())
    free = f"least distance between leaf and frame with the shuttle at its stop, {stop:.4g} mm up"
    return (
        at_least(names[0], min(stop, touch), limit, 0.0, unit="mm", reference=stopped),
        at_least(names[1], left, LEAF_GAP_MM, 0.0, unit="mm", reference=free),
    )


def _gaps(
    housing: Housing, lines: SolidLines, flexure: Flexure, roots: tuple[float, float]
) -> tuple[list[float], dict[float, float]]:
    """Return the deflections [mm] at which places of the shuttle, then of the upper leaf, touch what is above.

    Those of the leaf are held by the share of the deflection that the place moves, the shape of a guided leaf.
    """
    wall, shuttle = roots
    away = 1.0 if shuttle > wall else -1.0
    places = [shuttle + away * share * housing.shuttle_width for share in (0.02, 0.5, 0.98)]
    leaf = {}
    for share in (0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9):
        moved = 3.0 * share**2 - 2.0 * share**3
        at = (wall + share * (shuttle - wall), 0.0, housing.lower_leaf_level + flexure.separation)
        leaf[moved] = _gap_above(lines, at) / moved
    return [_gap_above(lines, (x, 0.0, housing.neck_level)) for x in places], leaf


def _gap_above(lines: SolidLines, place: Vector) -> float:
    """Return the first open distance above the material around a point [mm]; 0 where there is no such material."""
    spans = lines.spans(place, _UP)
    for i, (start, end) in enumerate(spans):
        if start <= 0.0 <= end:
            return spans[i + 1][0] - end if i + 1 < len(spans) else math.inf
    return 0.0
