"""The drawing of a housing: section, view from the left, and every dimension once, on a sheet [mm]."""

import math
from collections.abc import Iterator, Sequence

from cad.design.processes import Process
from cad.drawing.gauge_views import gauge_views
from cad.drawing.items import Box, Dimension, Item, Words, text_width, union, written
from cad.drawing.left_view import from_the_left
from cad.drawing.placing import TEXT_MM, Callout, Wanted, called_out, in_rows
from cad.drawing.section import section
from cad.drawing.sheet import Sheet, Title, on_sheet, rectangle
from cad.parts.housing import Arm, Housing, fillet_corners
from cad.parts.part import NEAR_MM, Part

_BETWEEN_MM = 14.0  # on paper, between the dimensions of the section and the view from the left
_LOOSE = "<>"


def housing_drawing(part: Part, housing: Housing, title: Title) -> Sheet:
    """Return the sheet of a housing: its section y = 0 seen along +y, and to the right the view from its left."""
    profile = tuple(section(part.shape))

    def views(scale: float) -> Sequence[Item]:
        return tuple(_views(profile, housing, title.process, scale))

    return on_sheet(views, _notes(housing, title.process), title)


def _views(profile: Sequence[Item], housing: Housing, process: Process, scale: float) -> Iterator[Item]:
    outline: Box = (housing.left, 0.0, housing.right, housing.top_level)
    wanted = [*_frame(housing), *_heights(housing), *_springs(housing, process), *_tips(housing), *_plate(housing)]
    dimensions = [*in_rows(wanted, outline, scale), *_within(housing, process, scale)]
    front = [*profile, *dimensions, *_pins(housing, scale)]
    yield from front
    box = union([item.box for item in front])
    yield from from_the_left(housing, box[2] + _BETWEEN_MM / scale, scale)
    yield from gauge_views(housing, box[3] + _BETWEEN_MM / scale, scale)


def _frame(housing: Housing) -> Iterator[Wanted]:
    """Yield what places the outer sides, the holes and the top bar."""
    left, right, top = housing.left, housing.right, housing.top_level
    (x0, _), (x1, z1), low = housing.holes[0], housing.holes[-1], housing.arms[0]
    yield Wanted(side="top", start=(left, top), end=(right, top))
    yield Wanted(side="top", start=(x0, z1), end=(x1, z1))
    yield Wanted(side="top", start=(left, top), end=(x0, z1))
    yield Wanted(side="bottom", start=(low.outer, housing.protrusion), end=(low.wall, housing.protrusion))
    yield Wanted(side="right", start=(housing.arms[-1].wall, housing.cavity_level), end=(right, top))


def _heights(housing: Housing) -> Iterator[Wanted]:
    """Yield what places the outer sides and the holes over the tips."""
    left, bottom, low = housing.left, housing.protrusion, housing.arms[0]
    (x0, z0), (_, z1) = housing.holes[0], housing.holes[-1]
    yield Wanted(side="left", start=(left, bottom), end=(left, housing.top_level))
    yield Wanted(side="left", start=(x0, z0), end=(x0, z1))
    yield Wanted(side="left", start=(left, bottom), end=(x0, z0))
    yield Wanted(side="left", start=(low.centre - 0.5 * housing.tip_side, 0.0), end=(left, bottom))


def _springs(housing: Housing, process: Process) -> Iterator[Wanted]:
    """Yield lengths and levels of the leaves."""
    off, high = f"<> ±{process.accuracy_mm:g}", housing.arms[-1]
    for arm in housing.arms:
        under = arm.levels[0] - 0.5 * arm.flexure.thickness
        a, b = arm.roots
        yield Wanted(side="bottom", start=(a, under), end=(b, under), label=off)
    lower, upper = high.levels
    yield Wanted(side="right", start=(high.centre, 0.0), end=(high.wall, lower))
    yield Wanted(side="right", start=(high.wall, lower), end=(high.wall, upper))


def _tips(housing: Housing) -> Iterator[Wanted]:
    """Yield the places and sizes of tips, necks and shuttles."""
    half, wide, neck, side = 0.5 * housing.spacing, 0.5 * housing.shuttle_width, housing.neck_level, housing.tip_side
    yield Wanted(side="bottom", start=(-half, 0.0), end=(half, 0.0))
    yield Wanted(side="bottom", start=(-half - wide, neck), end=(-half + wide, neck), label="<> 2x")
    if housing.tip_height < neck - NEAR_MM:
        yield Wanted(side="right", start=(half, 0.0), end=(half + 0.5 * side, housing.tip_height))
    yield Wanted(side="right", start=(half, 0.0), end=(half + wide, neck))


def _plate(housing: Housing) -> Iterator[Wanted]:
    """Yield the places of the dowels of a plate of a square; none of another housing."""
    if not housing.dowels:
        return
    (x0, z0), (x1, z1) = sorted(housing.dowels)
    yield Wanted(side="top", start=(x0, z0), end=(x1, z1))
    yield Wanted(side="left", start=(housing.left, housing.protrusion), end=(x0, z0))


def _within(housing: Housing, process: Process, scale: float) -> Iterator[Item]:
    """Yield what is said inside the section or at its corners: thicknesses, names, stops, radii, diameters."""
    for arm in housing.arms:
        yield from _in_window(arm, process, scale)
        yield _stop(housing, arm, scale)
    for callout in (
        *_fillet(housing, scale),
        screw_holes(housing, scale),
        *_dowels(housing, scale),
        *_dome(housing, scale),
    ):
        yield called_out(callout, scale)


def screw_holes(housing: Housing, scale: float) -> Callout:
    """Return the diameter [mm] of the holes for screws, at the upper left one, its text beside that corner."""
    beside, count = (housing.left, housing.top_level + 2.4 * TEXT_MM / scale), len(housing.holes)
    return Callout(
        kind="diameter",
        centre=housing.holes[1],
        radius=0.5 * housing.hole_diameter,
        turn=135.0,
        label=f"<> {count}x",
        beside=beside,
        side="left",
    )


def _dowels(housing: Housing, scale: float) -> Iterator[Callout]:
    """Yield the diameter of the holes for dowels, where there are any."""
    beside = (housing.right, housing.top_level + 2.4 * TEXT_MM / scale)
    for place in housing.dowels[-1:]:
        yield Callout(
            kind="diameter",
            centre=place,
            radius=0.5 * housing.dowel_hole,
            turn=45.0,
            label="<> 2x, dowels",
            beside=beside,
            side="right",
        )


def _dome(housing: Housing, scale: float) -> Iterator[Callout]:
    """Yield the radius of the domes, where tips are domes."""
    radius, beside = housing.dome_radius, (housing.left, -6.0 * TEXT_MM / scale)
    if radius:
        off = math.degrees(0.25 * housing.tip_side / radius)
        yield Callout(
            kind="radius",
            centre=(housing.arms[0].centre, radius),
            radius=radius,
            turn=270.0 - off,
            label="<> 2x, domes",
            beside=beside,
            side="left",
        )


def _in_window(arm: Arm, process: Process, scale: float) -> Iterator[Item]:
    """Yield the thickness of the leaves and the name of the spring, in the window between its leaves."""
    height, (left, right) = TEXT_MM / scale, arm.roots
    upper, half = arm.levels[1], 0.5 * arm.flexure.thickness
    label = f"<> ±{process.accuracy_mm:g}"
    width = text_width(f"{written(2.0 * half)} ±{process.accuracy_mm:g}", height)
    place = left + max(0.6 * height, 0.1 * (right - left))
    yield Dimension(
        kind="z",
        start=(place, upper - half),
        end=(place, upper + half),
        label=label,
        text_at=(place + 0.6 * height + 0.5 * width, upper - half - 2.0 * height),
        height=height,
        level=place,
    )
    middle = (0.5 * (left + right), 0.5 * sum(arm.levels) + 0.3 * height)
    yield Words(text=f"{arm.name.upper()} SPRING", at=middle, height=0.8 * height)


def _stop(housing: Housing, arm: Arm, scale: float) -> Dimension:
    """Return the gap over a shuttle, its text in the top bar."""
    height, gap = TEXT_MM / scale, (arm.top_level, housing.cavity_level)
    width = text_width(written(gap[1] - gap[0]), height)
    at = (arm.centre - 0.8 * height, gap[1] + height + 0.5 * width)
    start, end = (arm.centre, gap[0]), (arm.centre, gap[1])
    return Dimension(
        kind="z", start=start, end=end, label=_LOOSE, text_at=at, height=height, level=arm.centre, turn=90.0
    )


def _fillet(housing: Housing, scale: float) -> Iterator[Callout]:
    """Yield the radius of all fillets, at the lower leaf's root in the wall of the low spring."""
    arm, height, radius = housing.arms[0], TEXT_MM / scale, housing.low.fillet
    x, z = arm.wall, arm.levels[0] + 0.5 * arm.flexure.thickness
    yield Callout(
        kind="radius",
        centre=(x + radius, z + radius),
        radius=radius,
        turn=225.0,
        label=f"<> {len(fillet_corners(housing))}x",
        beside=(x, z + 1.4 * height),
        side="right",
    )


def _pins(housing: Housing, scale: float) -> Iterator[Item]:
    """Yield the pins in their pockets and what they are; none where the tips are printed."""
    if not housing.pin_side:
        return
    side, half, out, height = housing.pin_side, 0.5 * housing.pin_side, housing.pin_out, TEXT_MM / scale
    for arm in housing.arms:
        yield from rectangle((arm.centre - half, -out, arm.centre + half, housing.pocket_depth), "NOTES")
    section_of_pin = f"Ø{side:g}" if housing.pin_round else f"{side:g} x {side:g}"
    text = f"steel pin {section_of_pin} x {housing.pocket_depth + out:g} 2x, {out:g} out"
    at = (housing.left - 2.0 * height - 0.5 * text_width(text, height), -6.0 * height)
    yield Words(text=text, at=at, height=height)


def _notes(housing: Housing, process: Process) -> list[str]:
    """Return the notes of the sheet, from above."""
    layer = f", layer {process.layer_mm:g} mm" if process.layer_mm else ""
    faces = "tips are domes as made" if housing.dome_radius else "tip faces sharp-edged"
    notes = [
        "Millimetres. Section in the middle of the depth, and view from the left.",
        f"{process.material}{layer}; made flat, this profile in the plane of the bed.",
        f"Leaves solid: stiffness assumes E = {process.E_MPa:g} MPa. Two leaves of a spring are equal.",
        f"Gaps over the shuttles are stops; {faces}.",
        "Measure leaf thicknesses; calibrate both springs of each unit.",
    ]
    if housing.dowels:
        notes.append("Plate of a square: MAKE TWO, one turned half round the press axis, pads on pads.")
    if housing.pin_side:
        size = f"{housing.pocket_side:g} wide, {housing.pocket_depth:g} deep"
        notes.append(f"Pockets for steel pins {size}; pins stand out {housing.pin_out:g}.")
    return notes
