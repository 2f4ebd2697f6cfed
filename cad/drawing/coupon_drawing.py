"""The drawing of a coupon: its section, the view from the left, and every dimension once [mm]."""

import math
from collections.abc import Iterator, Sequence

from cad.drawing.items import Box, Dimension, Item, text_width, union, written
from cad.drawing.placing import TEXT_MM, Wanted, in_rows
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
        "Made flat beside the housing, with the same settings; leaves as those of the housing.",
        "Clamp the block; hang a weight in the hole of a pad, see the sheet.",
    )
    return on_sheet(views, notes, title)


def _views(profile: Sequence[Item], coupon: Coupon, title: Title, scale: float) -> Iterator[Item]:
    low, high = coupon.arms[0], coupon.arms[-1]
    half, tall = 0.5 * coupon.block_width, 0.5 * coupon.block_height
    ends = [half + arm.flexure.length + coupon.pad_side for arm in (low, high)]
    outline: Box = (-ends[0], -tall, ends[1], tall)
    front = [*profile, *in_rows([*_wanted(coupon, title.process.accuracy_mm)], outline, scale)]
    front += [
        *_radii(coupon, scale),
        *(_thickness(coupon, arm, title.process.accuracy_mm, scale) for arm in coupon.arms),
    ]
    yield from front
    start, deep = union([item.box for item in front])[2] + _BETWEEN_MM / scale, low.flexure.depth
    side: Box = (start, -tall, start + deep, tall)
    yield from rectangle(side, "PART")
    yield from in_rows([Wanted(side="top", start=(start, tall), end=(start + deep, tall))], side, scale)


def _wanted(coupon: Coupon, accuracy: float) -> Iterator[Wanted]:
    """Yield widths, heights and places of block, leaves, pads and holes."""
    half, tall, pad = 0.5 * coupon.block_width, 0.5 * coupon.block_height, coupon.pad_side
    clamp, low = half - CLAMP_INSET, coupon.arms[0]
    yield Wanted(side="top", start=(-half, tall), end=(half, tall))
    yield Wanted(side="top", start=(-clamp, 0.0), end=(clamp, 0.0))
    yield Wanted(side="left", start=(-half, -tall), end=(-half, tall))
    for arm in coupon.arms:
        under, end = -0.5 * arm.flexure.thickness, half + arm.flexure.length
        a, b = sorted((arm.sign * half, arm.sign * end))
        yield Wanted(side="bottom", start=(a, under), end=(b, under), label=f"<> ±{accuracy:g}")
    end = half + low.flexure.length
    yield Wanted(side="bottom", start=(-end - pad, -0.5 * pad), end=(-end, -0.5 * pad), label="<> 2x")
    yield Wanted(
        side="top", start=(-end - pad, 0.5 * pad), end=(-end - pad + coupon.arm_beyond_leaf, 0.0), label="<> 2x"
    )
    yield Wanted(side="left", start=(-end - pad, -0.5 * pad), end=(-end - pad, 0.5 * pad), label="<> 2x")


def _thickness(coupon: Coupon, arm: Arm, accuracy: float, scale: float) -> Dimension:
    """Return the thickness of a leaf, its text above it."""
    height, half = TEXT_MM / scale, 0.5 * arm.flexure.thickness
    label = f"<> ±{accuracy:g}"
    width = text_width(f"{written(2.0 * half)} ±{accuracy:g}", height)
    middle = arm.sign * (0.5 * coupon.block_width + 0.5 * arm.flexure.length)
    place = middle - 0.5 * width
    return Dimension(
        kind="z", start=(place, -half), end=(place, half), label=label, level=place,
        text_at=(place + 0.6 * height + 0.5 * width, half + 2.4 * height), height=height,
    )  # fmt: skip


def _radii(coupon: Coupon, scale: float) -> Iterator[Dimension]:
    """Yield the diameters of both kinds of holes and the radius of the fillets."""
    height, low = TEXT_MM / scale, coupon.arms[0]
    half, tall, radius = 0.5 * coupon.block_width, 0.5 * coupon.block_height, low.flexure.fillet
    turn = math.sqrt(0.5)
    label = "<> 8x"
    centre = (-half - radius, -0.5 * low.flexure.thickness - radius)
    at = (-half - 2.0 * height - 0.5 * text_width("R0.5 8x", height), -tall + 1.3 * height)
    yield Dimension(
        kind="radius", start=centre, end=(centre[0] + turn * radius, centre[1] + turn * radius),
        label=label, text_at=at, height=height,
    )  # fmt: skip
    for x, size, place in (
        (half - CLAMP_INSET, coupon.clamp_hole, (0.0, -0.6 * tall)),
        (half + coupon.arms[-1].flexure.length + coupon.arm_beyond_leaf, coupon.weight_hole, None),
    ):
        corner = 0.5 * size * turn
        beyond = x + coupon.pad_side + 0.5 * text_width("Ø2.5 2x", height)
        yield Dimension(
            kind="diameter", start=(x, 0.0), end=(x + (corner if place is None else -corner), -corner),
            label="<> 2x", text_at=place or (beyond, -tall - 0.5 * height), height=height,
        )  # fmt: skip
