"""The drawing of a coupon: its section, the view from the left, and every dimension once [mm]."""

from collections.abc import Iterator, Sequence

from cad.drawing.items import Box, Dimension, Item, Point, text_width, union, written
from cad.drawing.placing import TEXT_MM, Callout, Wanted, called_out, in_rows
from cad.drawing.section import section
from cad.drawing.sheet import Sheet, Title, on_sheet, rectangle
from cad.parts.coupon import CLAMP_INSET, Coupon
from cad.parts.housing import Arm
from cad.parts.part import Part

_BETWEEN_MM = 14.0  # on paper, between the dimensions of the section and the view from the left


def coupon_drawing(part: Part, coupon: Coupon, title: Title) -> Sheet:
    """Return the sheet of a coupon: its section y = 0 seen along +y, and to the right the view from its left."""
    profile = tuple(section(part.shape))

    def views(scale: float) -> Sequence[Item]:
        return tuple(_views(profile, coupon, title, scale))

    notes = (
        "Millimetres. Section in the middle of the depth, and view from the left.",
        "Made flat beside the housing, with the same settings; leaves as its own.",
        "Clamp the block; hang a weight in the hole of a pad, see the sheet.",
    )
    return on_sheet(views, notes, title)


def _views(profile: Sequence[Item], coupon: Coupon, title: Title, scale: float) -> Iterator[Item]:
    ends = [0.5 * coupon.block_width + arm.flexure.length + coupon.pad_side for arm in coupon.arms]
    tall, accuracy = 0.5 * coupon.block_height, title.process.accuracy_mm
    wanted = [*_block(coupon), *_leaves(coupon, accuracy), *_pads(coupon)]
    front = [*profile, *in_rows(wanted, (-ends[0], -tall, ends[-1], tall), scale)]
    front += [called_out(one, scale) for one in (_fillet(coupon, scale), *_holes(coupon, scale))]
    front += [_thickness(coupon, arm, accuracy, scale) for arm in coupon.arms]
    yield from front
    yield from _from_the_left(coupon, union([item.box for item in front])[2] + _BETWEEN_MM / scale, scale)


def _from_the_left(coupon: Coupon, start: float, scale: float) -> Iterator[Item]:
    """Yield the view from the left from a place x of the sheet on, with its depth."""
    tall, end = 0.5 * coupon.block_height, start + coupon.arms[0].flexure.depth
    side: Box = (start, -tall, end, tall)
    yield from rectangle(side, "PART")
    yield from in_rows([Wanted(side="top", start=(start, tall), end=(end, tall))], side, scale)


def _block(coupon: Coupon) -> Iterator[Wanted]:
    """Yield the sizes of the block and the places of its holes."""
    half, tall = 0.5 * coupon.block_width, 0.5 * coupon.block_height
    clamp = half - CLAMP_INSET
    yield Wanted(side="top", start=(-half, tall), end=(half, tall))
    yield Wanted(side="top", start=(-clamp, 0.0), end=(clamp, 0.0))
    yield Wanted(side="left", start=(-half, -tall), end=(-half, tall))


def _leaves(coupon: Coupon, accuracy: float) -> Iterator[Wanted]:
    """Yield the lengths of the leaves."""
    half = 0.5 * coupon.block_width
    for arm in coupon.arms:
        under, end = -0.5 * arm.flexure.thickness, half + arm.flexure.length
        start, stop = (arm.sign * half, under), (arm.sign * end, under)
        yield Wanted(side="bottom", start=start, end=stop, label=f"<> ±{accuracy:g}")


def _pads(coupon: Coupon) -> Iterator[Wanted]:
    """Yield the sizes of a pad and the place of its hole."""
    half, side = 0.5 * coupon.pad_side, coupon.pad_side
    root = -0.5 * coupon.block_width - coupon.arms[0].flexure.length
    yield Wanted(side="bottom", start=(root - side, -half), end=(root, -half), label="<> 2x")
    yield Wanted(side="top", start=(root - side, half), end=(root - coupon.arm_beyond_leaf, 0.0), label="<> 2x")
    yield Wanted(side="left", start=(root - side, -half), end=(root - side, half), label="<> 2x")


def _thickness(coupon: Coupon, arm: Arm, accuracy: float, scale: float) -> Dimension:
    """Return the thickness of a leaf, its text above it."""
    height, half, label = TEXT_MM / scale, 0.5 * arm.flexure.thickness, f"<> ±{accuracy:g}"
    width = text_width(label.replace("<>", written(2.0 * half)), height)
    place = arm.sign * 0.5 * (coupon.block_width + arm.flexure.length) - 0.5 * width
    at = (place + 0.6 * height + 0.5 * width, half + 2.4 * height)
    ends: tuple[Point, Point] = ((place, -half), (place, half))
    return Dimension(kind="z", start=ends[0], end=ends[1], label=label, level=place, text_at=at, height=height)


def _fillet(coupon: Coupon, scale: float) -> Callout:
    """Return the radius of the fillets, at the root of the first leaf in the block."""
    half, radius, first = 0.5 * coupon.block_width, coupon.arms[0].flexure.fillet, coupon.arms[0].flexure
    centre = (-half - radius, -0.5 * first.thickness - radius)
    beside = (-half, -0.5 * coupon.block_height + 1.3 * TEXT_MM / scale)
    count = 4 * len(coupon.arms)
    return Callout(
        kind="radius", centre=centre, radius=radius, turn=45.0, label=f"<> {count}x", beside=beside, side="left"
    )


def _holes(coupon: Coupon, scale: float) -> Iterator[Callout]:
    """Yield the diameters of the holes for the clamp and for weights."""
    last, height = coupon.arms[-1], TEXT_MM / scale
    clamp = 0.5 * coupon.block_width - CLAMP_INSET
    weight = 0.5 * coupon.block_width + last.flexure.length + coupon.arm_beyond_leaf
    under = -0.5 * coupon.block_height
    for x, size, turn, beside, side in (
        (clamp, coupon.clamp_hole, 225.0, (clamp, 0.6 * under), "left"),
        (weight, coupon.weight_hole, 315.0, (weight + 0.5 * coupon.pad_side, under - 0.5 * height), "right"),
    ):
        yield Callout(
            kind="diameter",
            centre=(x, 0.0),
            radius=0.5 * size,
            turn=turn,
            label="<> 2x",
            beside=beside,
            side="left" if side == "left" else "right",
        )
