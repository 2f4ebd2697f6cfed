"""The drawing of a coupon: its outline, the view from above, and every dimension once [mm]."""

from cad.drawing.canvas import MEASURED, Box, Canvas
from cad.drawing.lengths import Length, draw_lengths
from cad.drawing.sheet import BETWEEN_MM, Sheet, Title, on_sheet
from cad.drawing.view import draw_view, views_of
from cad.parts.coupon import (
    BEYOND_LEAF_MM,
    BLOCK_HEIGHT_MM,
    BLOCK_WIDTH_MM,
    CLAMP_HOLE_MM,
    CLAMP_INSET_MM,
    PAD_MM,
    WEIGHT_HOLE_MM,
)
from cad.parts.housing import Housing
from cad.parts.part import Part

_NOTES = (
    "Millimetres. View along the depth, and view from above.",
    "Made flat beside the housing, with the same settings; leaves as its own.",
    "Clamp the block; hang a weight in the hole of a pad, see the sheet.",
)
_TWICE = f"2x {MEASURED}"


def coupon_drawing(part: Part, housing: Housing, title: Title) -> Sheet:
    """Return the sheet of a coupon: its outline seen along +y, and below it the view from above."""
    (front,) = views_of([part.shape], "front")
    (above,) = views_of([part.shape], "above")
    within_accuracy = f"{MEASURED} ±{title.process.accuracy_mm:g}"

    def draw_views(canvas: Canvas) -> None:
        draw_view(canvas, front)
        _draw_lengths(canvas, housing, within_accuracy)
        _draw_thicknesses(canvas, housing, within_accuracy)
        _draw_callouts(canvas, housing)
        half = 0.5 * housing.depth
        level = canvas.extents().bottom - BETWEEN_MM / canvas.scale - half
        draw_view(canvas, above, (0.0, level), hidden=True)
        for x, _ in _holes(housing):
            canvas.centre_line((x, level - half), (x, level + half))
        box = part.shape.BoundingBox()
        outline = Box(box.xmin, level - half, box.xmax, level + half)
        draw_lengths(canvas, [Length("left", (box.xmin, level - half), (box.xmin, level + half))], outline)

    return on_sheet(draw_views, _NOTES, title)


def _draw_lengths(canvas: Canvas, housing: Housing, within_accuracy: str) -> None:
    left, right = -0.5 * BLOCK_WIDTH_MM, 0.5 * BLOCK_WIDTH_MM
    bottom, top = -0.5 * BLOCK_HEIGHT_MM, 0.5 * BLOCK_HEIGHT_MM
    lengths = [
        Length("top", (left, top), (right, top)),
        Length("top", (left + CLAMP_INSET_MM, 0.0), (right - CLAMP_INSET_MM, 0.0)),
        Length("left", (left, bottom), (left, top)),
    ]
    for arm in housing.arms:
        underside = -0.5 * arm.flexure.thickness
        root = (arm.sign * right, underside)
        end = (arm.sign * (right + arm.flexure.length), underside)
        lengths.append(Length("bottom", root, end, within_accuracy))

    low, high = housing.low, housing.high
    pad_right = left - low.length
    pad_left = pad_right - PAD_MM
    pad_foot = (pad_left, -0.5 * PAD_MM)
    pad_top = (pad_left, 0.5 * PAD_MM)
    lengths += [
        Length("bottom", pad_foot, (pad_right, -0.5 * PAD_MM), _TWICE),
        Length("top", pad_top, (pad_right - BEYOND_LEAF_MM, 0.0), _TWICE),
        Length("left", pad_foot, pad_top, _TWICE),
    ]
    draw_lengths(canvas, lengths, Box(pad_left, bottom, right + high.length + PAD_MM, top))


def _draw_thicknesses(canvas: Canvas, housing: Housing, within_accuracy: str) -> None:
    """Draw the thickness of each leaf, its text above it."""
    height = canvas.text_height
    for arm in housing.arms:
        top = 0.5 * arm.flexure.thickness
        half_label = 0.5 * canvas.label_width(within_accuracy, arm.flexure.thickness)
        x = arm.sign * 0.5 * (BLOCK_WIDTH_MM + arm.flexure.length) - half_label
        text_at = (x + 0.6 * height + half_label, top + 2.4 * height)
        canvas.length("z", (x, -top), (x, top), text_at, x, within_accuracy)


def _holes(housing: Housing) -> list[tuple[float, float]]:
    """Return x and the diameter of every hole, all on the middle line [mm]."""
    clamp = 0.5 * BLOCK_WIDTH_MM - CLAMP_INSET_MM
    holes = [(-clamp, CLAMP_HOLE_MM), (clamp, CLAMP_HOLE_MM)]
    for arm in housing.arms:
        weight = 0.5 * BLOCK_WIDTH_MM + arm.flexure.length + BEYOND_LEAF_MM
        holes.append((arm.sign * weight, WEIGHT_HOLE_MM))
    return holes


def _draw_callouts(canvas: Canvas, housing: Housing) -> None:
    """Draw the radius of the fillets, at the root of the first leaf in the block, and the diameters of the holes."""
    left, right = -0.5 * BLOCK_WIDTH_MM, 0.5 * BLOCK_WIDTH_MM
    bottom = -0.5 * BLOCK_HEIGHT_MM
    low, high = housing.low, housing.high
    centre = (left - low.fillet, -0.5 * low.thickness - low.fillet)
    below_leaf = (left, bottom + 1.3 * canvas.text_height)
    label = f"{4 * len(housing.arms)}x {MEASURED}"
    canvas.callout("radius", centre, low.fillet, below_leaf, "left", label, angle=45.0)

    clamp = right - CLAMP_INSET_MM
    canvas.callout("diameter", (clamp, 0.0), CLAMP_HOLE_MM, (clamp, 0.6 * bottom), "left", _TWICE)
    weight = right + high.length + BEYOND_LEAF_MM
    below_pad = (weight, bottom - 0.5 * canvas.text_height)
    canvas.callout("diameter", (weight, 0.0), WEIGHT_HOLE_MM, below_pad, "right", _TWICE)
    for x, diameter in _holes(housing):
        canvas.centre_mark((x, 0.0), 0.5 * diameter)
