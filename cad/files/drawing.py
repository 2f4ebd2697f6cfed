"""The drawing of a housing: its profile and its end, every controlling dimension [mm] and what it may be off."""

import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import cadquery as cq

from cad.design.processes import Process
from cad.files.drafting import FULL_DEG, Arc, Item, Line, Point, Words, horizontal_dimension, leader, vertical_dimension
from cad.parts.housing import Arm, Housing, fillet_corners
from cad.parts.part import NEAR_MM, Part
from cad.theory.strain_gauge import GAUGES, FoilGauge, gauge_spans

GENERAL_MM = 0.2  # what no dimension says otherwise: the accuracy of a printed part in print-service guides
_STEP = 6.0  # between two rows of dimensions
_ABOVE = 20.0  # of the upper leaf seen from above, over the top of the housing
_TWO_PLATES = (
    "Plate of a square: MAKE TWO; one, turned half round the press axis, stands behind the other, pads on pads",
    "End view: the face with the pads to the right; marks on the pads",
)
_THICK = 0.25  # of a gauge seen from its edge, many times its thickness


@dataclass(frozen=True, kw_only=True)
class Title:
    """What stands in the corner of a drawing."""

    name: str
    process: Process


def housing_drawing(part: Part, housing: Housing, title: Title) -> tuple[Item, ...]:
    """Return profile (section y = 0, seen along +y), end view and dimensions of a housing [mm]."""
    return (
        *section(part.shape),
        *_end_view(housing),
        *(item for arm in housing.arms for item in _leaf_dimensions(arm, title.process)),
        *_frame_dimensions(housing),
        *_fillet_note(housing),
        *_tip_dimensions(housing),
        *_stop_notes(housing),
        *gauge_marks(housing),
        *_pins(housing),
        *_plate_of_two(housing),
        *_notes(housing, title),
    )


def section(shape: cq.Shape) -> Iterator[Item]:
    """Yield the lines and arcs in which the plane y = 0 cuts a solid, x to the right and z up."""
    plane = cq.Face.makePlane(4e3, 4e3, cq.Vector(0.0, 0.0, 0.0), cq.Vector(0.0, 1.0, 0.0))
    for edge in plane.intersect(shape).Edges():
        if edge.geomType() == "LINE":
            start, end = edge.startPoint(), edge.endPoint()
            yield Line(start=(start.x, start.z), end=(end.x, end.z))
        else:
            yield _arc(edge)


def _arc(edge: cq.Edge) -> Arc:
    centre, middle = edge.arcCenter(), edge.positionAt(0.5)
    if edge.IsClosed():
        return Arc(centre=(centre.x, centre.z), radius=edge.radius(), start=0.0, end=FULL_DEG)
    a, b, m = (
        math.degrees(math.atan2(point.z - centre.z, point.x - centre.x)) % FULL_DEG
        for point in (edge.startPoint(), edge.endPoint(), middle)
    )
    if (m - a) % FULL_DEG > (b - a) % FULL_DEG:
        a, b = b, a
    return Arc(centre=(centre.x, centre.z), radius=edge.radius(), start=a, end=a + (b - a) % FULL_DEG)


def _end_view(housing: Housing) -> Iterator[Item]:
    """Yield the outline of the plate and of a tip seen along x, to the right of the profile."""
    middle = housing.right + 4.0 * _STEP + 0.5 * housing.depth
    deep, tip, top = 0.5 * housing.depth, 0.5 * housing.tip_side, housing.top_level
    plate, face = (middle - deep, middle + deep), (middle - tip, middle + tip)
    y = (plate[0], face[0], face[0], face[1], face[1], plate[1])
    z = (housing.neck_level, housing.tip_height, 0.0, 0.0, housing.tip_height, housing.neck_level)
    yield from _rectangle(plate, (housing.protrusion, top), "PART")
    yield from _polyline(list(zip(y, z, strict=True)), "NOTES")
    end = "foot" if housing.pin_side else "tip"
    yield from horizontal_dimension(plate, top + _STEP, f"depth {housing.depth:g}", (top, top))
    yield from horizontal_dimension(face, -_STEP, f"{end} {housing.tip_side:g}", (0.0, 0.0))


def _polyline(points: Sequence[Point], layer: str) -> Iterator[Item]:
    """Yield the lines between neighbouring points, but for those of no length."""
    for start, end in itertools.pairwise(points):
        if math.dist(start, end) > NEAR_MM:
            yield Line(start=start, end=end, layer=layer)


def _rectangle(x: Point, z: Point, layer: str) -> Iterator[Item]:
    corners = [(x[0], z[0]), (x[1], z[0]), (x[1], z[1]), (x[0], z[1])]
    return _polyline([*corners, corners[0]], layer)


def _leaf_dimensions(arm: Arm, process: Process) -> Iterator[Item]:
    flexure, (left, right), (lower, upper) = arm.flexure, arm.roots, arm.levels
    half, middle, centre = 0.5 * flexure.thickness, 0.5 * (lower + upper), 0.5 * (left + right)
    off, under = f"±{process.accuracy_mm:g}", upper - half
    yield from horizontal_dimension((left, right), middle - 3.0, f"L {flexure.length:.3f} {off}", (under, under))
    yield from vertical_dimension((lower, upper), left + 0.1 * (right - left), f"{flexure.separation:g}")
    thickness = f"t {flexure.thickness:.2f}{off} 2x"
    yield from leader((left + 0.55 * (right - left), under), (centre - 6.0, middle + 2.2), thickness)
    yield Words(text=f"{arm.name.upper()} SPRING", at=(centre, lower + 1.2), height=1.0)


def _frame_dimensions(housing: Housing) -> Iterator[Item]:
    left, right, top, bottom = housing.left, housing.right, housing.top_level, housing.protrusion
    yield from horizontal_dimension((left, right), top + 2.0 * _STEP, f"{right - left:.3f}", (top, top))
    yield from _hole_spacings(housing)
    yield from vertical_dimension((bottom, top), left - 2.0 * _STEP, f"{top - bottom:.2f}", (left, left))
    yield from vertical_dimension((0.0, bottom), left - _STEP, f"{bottom:.2f}", (housing.arms[0].shuttle, left))
    beside = 0.35 * housing.hole_diameter
    edge = (housing.holes[-1][0] + beside, housing.holes[0][1] - beside)
    yield from leader(edge, (right + 2.0, bottom - 4.0), f"dia {housing.hole_diameter:g} 4x")


def _hole_spacings(housing: Housing) -> Iterator[Item]:
    (x0, z0), (x1, z1) = housing.holes[0], housing.holes[-1]
    yield from horizontal_dimension((x0, x1), housing.top_level + _STEP, f"{x1 - x0:.3f}", (z1, z1))
    yield from vertical_dimension((z0, z1), housing.left - _STEP, f"{z1 - z0:.2f}", (x0, x0))


def _fillet_note(housing: Housing) -> tuple[Item, ...]:
    arm, count = housing.arms[-1], len(fillet_corners(housing))
    corner = arm.wall, arm.levels[0] + 0.5 * arm.flexure.thickness
    return leader(corner, (housing.right + 2.0, corner[1] + 3.0), f"R {arm.flexure.fillet:g} {count}x")


def _tip_dimensions(housing: Housing) -> Iterator[Item]:
    half, wide, neck = 0.5 * housing.spacing, 0.5 * housing.shuttle_width, housing.neck_level
    outer, place, shuttle = half + wide, half + wide + 2.0, f"shuttle {housing.shuttle_width:g} 2x"
    yield from horizontal_dimension((-half, half), -_STEP, f"tips {housing.spacing:.3f}", (0.0, 0.0))
    yield from horizontal_dimension((-half - wide, -half + wide), -2.0 * _STEP, shuttle, (neck, neck))
    yield from vertical_dimension((0.0, housing.tip_height), place + 3.0, f"{housing.tip_height:g}", (half, half))
    yield from vertical_dimension((0.0, neck), place + 7.0, f"{neck:g}", (half, outer))


def _stop_notes(housing: Housing) -> Iterator[Item]:
    outer = 0.5 * housing.spacing + 0.5 * housing.shuttle_width
    for arm in housing.arms:
        text_at = (outer if arm.sign > 0.0 else -outer - 12.0, housing.top_level + 2.0)
        stop = f"stop {arm.name} {housing.cavity_level - arm.top_level:.2f}"
        yield from leader((arm.centre, arm.top_level), text_at, stop)


def _pins(housing: Housing) -> Iterator[Item]:
    """Yield the pins in their pockets, and their size; none where the tips are printed."""
    if not housing.pin_side:
        return
    side, half, out = housing.pin_side, 0.5 * housing.pin_side, housing.pin_out
    for arm in housing.arms:
        yield from _rectangle((arm.centre - half, arm.centre + half), (-out, housing.pocket_depth), "NOTES")
    section = f"diameter {side:g}" if housing.pin_round else f"{side:g} x {side:g}"
    size, place = f"{section} x {housing.pocket_depth + out:g}", 0.5 * housing.spacing
    yield from leader((place + half, -0.5 * out), (place + 6.0, -1.5 * _STEP), f"steel pin {size} 2x, {out:g} out")


def _plate_of_two(housing: Housing) -> Iterator[Item]:
    """Yield the domes, the holes for dowels and the pads as seen from the end, where a plate has them."""
    if housing.dome_radius:
        outer = 0.5 * housing.spacing + 0.3 * housing.tip_side
        yield from leader((outer, 0.2), (outer + 6.0, -1.5 * _STEP), f"dome R {housing.dome_radius:g} 2x")
    for x, z in housing.dowels[-1:]:
        words = f"dia {housing.dowel_hole:g} 2x, dowels"
        yield from leader((x, z), (housing.right + 2.0, housing.top_level + 3.0), words)
    if housing.pad_height:
        foot, face = max(housing.cover_level, housing.protrusion), housing.right + 4.0 * _STEP + housing.depth
        pad = (face, face + housing.pad_height)
        yield from _rectangle(pad, (foot, housing.top_level), "PART")
        yield from leader((pad[1], foot), (pad[1] + 3.0, foot - 3.0), f"pads {housing.pad_height:g} high")


def _notes(housing: Housing, title: Title) -> Iterator[Item]:
    process, tips = title.process, "domes as printed" if housing.dome_radius else "tip faces sharp-edged"
    layer = f", layer {process.layer_mm:g}" if process.layer_mm else ""
    lines = (
        f"{title.name}: two-spring housing, one piece, millimetres",
        f"{process.name}: {process.material}{layer}; print flat, this profile in the bed plane",
        f"Leaves solid (no infill): the stiffness assumes E = {process.E_MPa:g} MPa in a full section",
        f"Leaf thickness and length ±{process.accuracy_mm:g}; other dimensions ±{GENERAL_MM:g}; {tips}",
        "Measure both leaf thicknesses; calibrate K_l and K_h of each unit before use",
        *_TWO_PLATES[: len(housing.dowels)],
    )
    for count, line in enumerate(lines):
        at = (housing.left, -3.0 * _STEP - 2.6 * count)
        yield Words(text=line, at=at, height=1.5, centred=False, layer="NOTES")


def gauge_marks(housing: Housing) -> Iterator[Item]:
    """Yield the gauges on the profile from their edges, and on the upper leaves seen from above; none without gauges.

    Nothing is engraved in a leaf. Raises InputError for a leaf without room for them.
    """
    gauge = GAUGES[housing.gauges]
    if gauge is None:
        return
    for arm in housing.arms:
        level, half, deep = arm.levels[1], 0.5 * arm.flexure.thickness, 0.5 * arm.flexure.depth
        for spans in gauge_spans(arm.flexure, gauge):
            for face in (-1.0, 1.0):
                edge = (level + face * half, level + face * (half + _THICK))
                yield from _rectangle(arm.along(spans.backing), edge, "NOTES")
        middle = housing.top_level + _ABOVE + deep
        yield from _rectangle((arm.wall, arm.shuttle), (middle - deep, middle + deep), "PART")
        yield from _gauges_from_above(arm, gauge, middle)
        words = f"{arm.name.upper()} UPPER LEAF FROM ABOVE: GAUGE AT EACH ROOT, ON BOTH FACES"
        yield Words(text=words, at=(0.5 * (arm.wall + arm.shuttle), middle + deep + 1.0), height=0.7)


def _gauges_from_above(arm: Arm, gauge: FoilGauge, middle: float) -> Iterator[Item]:
    """Yield the gauges of an upper leaf and their sizes, about a line at a height of the drawing."""
    wide, grid_wide = 0.5 * gauge.backing_width_mm, 0.5 * gauge.grid_width_mm
    for spans in gauge_spans(arm.flexure, gauge):
        yield from _rectangle(arm.along(spans.backing), (middle - wide, middle + wide), "NOTES")
        yield from _rectangle(arm.along(spans.grid), (middle - grid_wide, middle + grid_wide), "NOTES")
    yield from _gauge_sizes(arm, gauge, middle)


def _gauge_sizes(arm: Arm, gauge: FoilGauge, middle: float) -> Iterator[Item]:
    wide, edge = 0.5 * gauge.backing_width_mm, middle - 0.5 * arm.flexure.depth
    under = middle - wide
    spans, backing_mm = gauge_spans(arm.flexure, gauge)[0], f"{gauge.backing_length_mm:g} x {gauge.backing_width_mm:g}"
    start, grid_mm = spans.backing[0], f"grid {gauge.grid_length_mm:g} x {gauge.grid_width_mm:g}"
    rows = ((7.0, (0.0, start), f"{start:g}"), (2.0, spans.backing, backing_mm), (4.5, spans.grid, grid_mm))
    for drop, span, text in rows:
        yield from horizontal_dimension(arm.along(span), edge - drop, text, (under, under))
    yield from vertical_dimension((under, middle), 0.5 * (arm.wall + arm.shuttle), f"{wide:g}")
