"""The drawing of a coupon: its section, the view from the left, and every dimension once [mm]."""

from cad.drawing.canvas import Box, Canvas, format_length, text_width
from cad.drawing.lengths import Length, draw_lengths
from cad.drawing.section import draw_section, section
from cad.drawing.sheet import BETWEEN_MM, Sheet, Title, on_sheet
from cad.parts.coupon import CLAMP_INSET, Coupon
from cad.parts.part import Part

_NOTES = (
    "Millimetres. Section in the middle of the depth, and view from the left.",
    "Made flat beside the housing, with the same settings; leaves as its own.",
    "Clamp the block; hang a weight in the hole of a pad, see the sheet.",
)


def coupon_drawing(part: Part, coupon: Coupon, title: Title) -> Sheet:
    """Return the sheet of a coupon: its section y = 0 seen along +y, and to the right the view from its left."""
    profile = section(part.shape)
    accuracy = f"<> ±{title.process.accuracy_mm:g}"

    def draw_views(canvas: Canvas) -> None:
        draw_section(canvas, profile)
        _draw_lengths(canvas, coupon, accuracy)
        _draw_thicknesses(canvas, coupon, accuracy)
        _draw_callouts(canvas, coupon)
        _draw_from_the_left(canvas, coupon, canvas.extents().right + BETWEEN_MM / canvas.scale)

    return on_sheet(draw_views, _NOTES, title)


def _draw_lengths(canvas: Canvas, coupon: Coupon, accuracy: str) -> None:
    half, tall = 0.5 * coupon.block_width, 0.5 * coupon.block_height
    clamp = half - CLAMP_INSET
    lengths = [
        Length(side="top", start=(-half, tall), end=(half, tall)),
        Length(side="top", start=(-clamp, 0.0), end=(clamp, 0.0)),
        Length(side="left", start=(-half, -tall), end=(-half, tall)),
    ]
    for arm in coupon.arms:
        under, end = -0.5 * arm.flexure.thickness, half + arm.flexure.length
        start, stop = (arm.sign * half, under), (arm.sign * end, under)
        lengths.append(Length(side="bottom", start=start, end=stop, label=accuracy))
    side, middle = coupon.pad_side, 0.5 * coupon.pad_side
    root = -half - coupon.arms[0].flexure.length
    lengths += [
        Length(side="bottom", start=(root - side, -middle), end=(root, -middle), label="<> 2x"),
        Length(side="top", start=(root - side, middle), end=(root - coupon.arm_beyond_leaf, 0.0), label="<> 2x"),
        Length(side="left", start=(root - side, -middle), end=(root - side, middle), label="<> 2x"),
    ]
    left, right = (half + arm.flexure.length + side for arm in (coupon.arms[0], coupon.arms[-1]))
    draw_lengths(canvas, lengths, Box(-left, -tall, right, tall))


def _draw_thicknesses(canvas: Canvas, coupon: Coupon, accuracy: str) -> None:
    """Draw the thickness of each leaf, its text above it."""
    height = canvas.text_height
    for arm in coupon.arms:
        half = 0.5 * arm.flexure.thickness
        width = text_width(accuracy.replace("<>", format_length(2.0 * half)), height)
        x = arm.sign * 0.5 * (coupon.block_width + arm.flexure.length) - 0.5 * width
        text_at = (x + 0.6 * height + 0.5 * width, half + 2.4 * height)
        canvas.length("z", (x, -half), (x, half), text_at, x, accuracy)


def _draw_callouts(canvas: Canvas, coupon: Coupon) -> None:
    """Draw the radius of the fillets, at the root of the first leaf in the block, and the diameters of the holes."""
    half, under = 0.5 * coupon.block_width, -0.5 * coupon.block_height
    first, last = coupon.arms[0].flexure, coupon.arms[-1].flexure
    radius = first.fillet
    corner = (-half - radius, -0.5 * first.thickness - radius)
    below_leaf = (-half, under + 1.3 * canvas.text_height)
    canvas.callout("radius", corner, radius, below_leaf, "left", f"<> {4 * len(coupon.arms)}x", angle=45.0)

    clamp = half - CLAMP_INSET
    canvas.callout("diameter", (clamp, 0.0), coupon.clamp_hole, (clamp, 0.6 * under), "left", "<> 2x")
    weight = half + last.length + coupon.arm_beyond_leaf
    below_pad = (weight + 0.5 * coupon.pad_side, under - 0.5 * canvas.text_height)
    canvas.callout("diameter", (weight, 0.0), coupon.weight_hole, below_pad, "right", "<> 2x")


def _draw_from_the_left(canvas: Canvas, coupon: Coupon, start: float) -> None:
    """Draw the view from the left, from a place x of the sheet on, with its depth."""
    tall, end = 0.5 * coupon.block_height, start + coupon.arms[0].flexure.depth
    side = Box(start, -tall, end, tall)
    canvas.rectangle(side)
    draw_lengths(canvas, [Length(side="top", start=(start, tall), end=(end, tall))], side)
