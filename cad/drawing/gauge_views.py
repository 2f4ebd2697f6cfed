"""Where strain gauges lie: on the section from their edges, and on the upper leaves seen from above."""

from collections.abc import Iterator

from cad.drawing.items import Box, Item, Words
from cad.drawing.placing import TEXT_MM, Wanted, in_rows
from cad.drawing.sheet import rectangle
from cad.parts.housing import Arm, Housing
from cad.theory.strain_gauge import GAUGES, FoilGauge, gauge_spans

_THICK = 0.25  # of a gauge seen from its edge, many times its thickness


def gauge_views(housing: Housing, level: float, scale: float) -> Iterator[Item]:
    """Yield the gauges on the section, and from a level of the sheet [mm] on the upper leaves from above.

    Nothing without gauges. Raises InputError for a leaf without room for them.
    """
    gauge = GAUGES[housing.gauges]
    if gauge is None:
        return
    for arm in housing.arms:
        upper, half = arm.levels[1], 0.5 * arm.flexure.thickness
        for spans in gauge_spans(arm.flexure, gauge):
            start, end = sorted(arm.along(spans.backing))
            for face in (-1.0, 1.0):
                below, above = sorted((upper + face * half, upper + face * (half + _THICK)))
                yield from rectangle((start, below, end, above), "NOTES")
        yield from _from_above(arm, gauge, level, scale)


def _from_above(arm: Arm, gauge: FoilGauge, level: float, scale: float) -> Iterator[Item]:
    """Yield an upper leaf from above with the gauges at its roots, and their sizes and places."""
    deep, height, (left, right) = 0.5 * arm.flexure.depth, TEXT_MM / scale, arm.roots
    base = level + 24.0 / scale  # room for two rows of dimensions below it
    middle = base + deep
    leaf: Box = (left, base, right, middle + deep)
    yield from rectangle(leaf, "PART")
    yield from _outlines(arm, gauge, middle)
    yield from in_rows([*_along(arm, gauge, middle), *_across(arm, gauge, middle)], leaf, scale)
    title = f"{arm.name.upper()} UPPER LEAF"
    yield Words(text=title, at=(0.5 * (left + right), leaf[3] + height), height=0.7 * height)


def _outlines(arm: Arm, gauge: FoilGauge, middle: float) -> Iterator[Item]:
    """Yield backing and grid of the gauges at both roots, about a line of the sheet."""
    wide, grid_wide = 0.5 * gauge.backing_width_mm, 0.5 * gauge.grid_width_mm
    for spans in gauge_spans(arm.flexure, gauge):
        for span, across in ((spans.backing, wide), (spans.grid, grid_wide)):
            start, end = sorted(arm.along(span))
            yield from rectangle((start, middle - across, end, middle + across), "NOTES")


def _along(arm: Arm, gauge: FoilGauge, middle: float) -> Iterator[Wanted]:
    """Yield place and lengths of the gauge at the wall."""
    spans, edge = gauge_spans(arm.flexure, gauge)[0], middle - 0.5 * gauge.backing_width_mm
    for span in ((0.0, spans.backing[0]), spans.backing, spans.grid):
        start, end = arm.along(span)
        yield Wanted(side="bottom", start=(start, edge), end=(end, edge))


def _across(arm: Arm, gauge: FoilGauge, middle: float) -> Iterator[Wanted]:
    """Yield the widths of a gauge, which are those of all, beside the first leaf."""
    if arm.sign < 0.0:
        for width in (gauge.backing_width_mm, gauge.grid_width_mm):
            start, end = (arm.wall, middle - 0.5 * width), (arm.wall, middle + 0.5 * width)
            yield Wanted(side="left", start=start, end=end)
