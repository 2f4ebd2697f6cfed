"""The drawing of a housing: its profile and its end, every controlling dimension [mm] and what it may be off."""

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass

import cadquery as cq

from cad.design.processes import Process
from cad.files.drafting import FULL_DEG, Arc, Item, Line, Words, across, note, upright
from cad.files.gauge_marks import gauge_marks
from cad.parts.housing import Housing, fillet_corners
from cad.parts.part import Part
from cad.theory.flexure import Flexure

GENERAL_MM = 0.2  # what no dimension says otherwise: the accuracy of a printed part in print-service guides
_NEAR = 1e-7
_STEP = 6.0  # between two rows of dimensions


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
        *_leaf_dimensions(housing, "low", title.process),
        *_leaf_dimensions(housing, "high", title.process),
        *_frame_dimensions(housing),
        *_tip_dimensions(housing),
        *gauge_marks(housing),
        *_pins(housing),
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
    deep, tip = 0.5 * housing.depth, 0.5 * housing.tip_side
    foot, top = housing.protrusion, housing.top_level
    frame = [(-deep, foot), (deep, foot), (deep, top), (-deep, top), (-deep, foot)]
    neck = [
        (-deep, housing.neck_level), (-tip, housing.tip_height), (-tip, 0.0), (tip, 0.0), (tip, housing.tip_height),
        (deep, housing.neck_level),
    ]  # fmt: skip
    for outline, layer in ((frame, "PART"), (neck, "NOTES")):
        for (y1, z1), (y2, z2) in itertools.pairwise(outline):
            if math.dist((y1, z1), (y2, z2)) > _NEAR:
                yield Line(start=(middle + y1, z1), end=(middle + y2, z2), layer=layer)
    yield from across((middle - deep, middle + deep), top + _STEP, f"depth {housing.depth:g}", (top, top))
    yield from across((middle - tip, middle + tip), -_STEP, f"{_end(housing)} {housing.tip_side:g}", (0.0, 0.0))


def _end(housing: Housing) -> str:
    """Return what a printed shuttle ends in."""
    return "foot" if housing.pin_side else "tip"


def _leaf_dimensions(housing: Housing, side: str, process: Process) -> Iterator[Item]:
    flexure: Flexure = housing.low if side == "low" else housing.high
    roots = housing.low_root if side == "low" else housing.high_root
    left, right = min(roots), max(roots)
    lower, upper = housing.lower_leaf_level, housing.lower_leaf_level + flexure.separation
    half, middle = 0.5 * flexure.thickness, 0.5 * (lower + upper)
    off = f"±{process.accuracy_mm:g}"
    yield from across((left, right), middle - 3.0, f"L {flexure.length:.3f} {off}", (upper - half, upper - half))
    place = left + 0.1 * (right - left)
    yield from upright((lower, upper), place, f"{flexure.separation:g}")
    at = (left + 0.55 * (right - left), upper - half)
    text_at = (0.5 * (left + right) - 6.0, middle + 2.2)
    yield from note(at, text_at, f"t {flexure.thickness:.2f}{off} 2x")
    yield Words(text=f"{side.upper()} SPRING", at=(0.5 * (left + right), lower + 1.2), height=1.0)


def _frame_dimensions(housing: Housing) -> Iterator[Item]:
    left, right, top, foot = housing.left, housing.right, housing.top_level, housing.protrusion
    yield from across((left, right), top + 2.0 * _STEP, f"{right - left:.3f}", (top, top))
    columns = sorted({x for x, _ in housing.holes})
    rows = sorted({z for _, z in housing.holes})
    yield from across((columns[0], columns[1]), top + _STEP, f"{columns[1] - columns[0]:.3f}", (rows[1], rows[1]))
    yield from upright((rows[0], rows[1]), left - _STEP, f"{rows[1] - rows[0]:.2f}", (columns[0], columns[0]))
    yield from upright((foot, top), left - 2.0 * _STEP, f"{top - foot:.2f}", (left, left))
    yield from upright((0.0, foot), left - _STEP, f"{foot:.2f}", (housing.low_root[1], left))
    hole = (columns[1] + 0.35 * housing.hole_diameter, rows[0] - 0.35 * housing.hole_diameter)
    yield from note(hole, (right + 2.0, foot - 4.0), f"dia {housing.hole_diameter:g} 4x")
    corner = housing.high_root[0], housing.lower_leaf_level + 0.5 * housing.high.thickness
    count = len(fillet_corners(housing))
    yield from note(corner, (right + 2.0, corner[1] + 3.0), f"R {housing.low.fillet:g} {count}x")


def _tip_dimensions(housing: Housing) -> Iterator[Item]:
    half = 0.5 * housing.spacing
    yield from across((-half, half), -_STEP, f"tips {housing.spacing:.3f}", (0.0, 0.0))
    wide = 0.5 * housing.shuttle_width
    shuttle = (-half - wide, -half + wide)
    yield from across(shuttle, -2.0 * _STEP, f"shuttle {housing.shuttle_width:g} 2x", (housing.neck_level,) * 2)
    x = half + wide + 2.0
    yield from upright((0.0, housing.tip_height), x + 3.0, f"{housing.tip_height:g}", (half, half))
    yield from upright((0.0, housing.neck_level), x + 7.0, f"{housing.neck_level:g}", (half, half + wide))
    for sign, side, top in ((-1.0, "low", housing.low_top_level), (1.0, "high", housing.high_top_level)):
        gap = housing.cavity_level - top
        at = (sign * half, top)
        text_at = (-half - wide - 12.0 if side == "low" else half + wide, housing.top_level + 2.0)
        yield from note(at, text_at, f"stop {side} {gap:.2f}")


def _pins(housing: Housing) -> Iterator[Item]:
    """Yield the pins in their pockets, and their size; none where the tips are printed."""
    if not housing.pin_side:
        return
    foot, top, half = -housing.pin_out, housing.pocket_depth, 0.5 * housing.pin_side
    for x in (-0.5 * housing.spacing, 0.5 * housing.spacing):
        corners = [(x - half, foot), (x + half, foot), (x + half, top), (x - half, top), (x - half, foot)]
        for start, end in itertools.pairwise(corners):
            yield Line(start=start, end=end, layer="NOTES")
    at = (0.5 * housing.spacing + half, 0.5 * foot)
    section = f"diameter {housing.pin_side:g}" if housing.pin_round else f"{housing.pin_side:g} x {housing.pin_side:g}"
    size = f"{section} x {top - foot:g}"
    yield from note(at, (0.5 * housing.spacing + 6.0, -1.5 * _STEP), f"steel pin {size} 2x, {housing.pin_out:g} out")


def _notes(housing: Housing, title: Title) -> Iterator[Item]:
    process = title.process
    layer = f", layer {process.layer_mm:g}" if process.layer_mm else ""
    lines = (
        f"{title.name}: two-spring housing, one piece, millimetres",
        f"{process.name}: {process.material}{layer}; print flat, this profile in the bed plane",
        f"Leaves solid (no infill): the stiffness assumes E = {process.E_MPa:g} MPa in a full section",
        f"Leaf thickness and length ±{process.accuracy_mm:g}; other dimensions ±{GENERAL_MM:g}; tip faces sharp-edged",
        "Measure both leaf thicknesses; calibrate K_l and K_h of each unit before use",
    )
    for count, line in enumerate(lines):
        at = (housing.left, -3.0 * _STEP - 2.6 * count)
        yield Words(text=line, at=at, height=1.5, centred=False, layer="NOTES")
