"""Where strain gauges lie: on the section from their edges, and on the upper leaves seen from above."""

from collections.abc import Iterator

from cad.drawing.items import Item, Words
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
                low, high = sorted((upper + face * half, upper + face * (half + _THICK)))
                yield from rectangle((start, low, end, high), "NOTES")
        yield from _from_above(arm, gauge, level, scale)


def _from_above(arm: Arm, gauge: FoilGauge, level: float, scale: float) -> Iterator[Item]:
    """Yield an upper leaf from above with the gauges at its roots, and their sizes and places."""
    deep, height = 0.5 * arm.flexure.depth, TEXT_MM / scale
    base = level + 24.0 / scale  # room for two rows of dimensions below it
    middle, (left, right) = base + deep, arm.roots
    yield from rectangle((left, base, right, middle + deep), "PART")
    wide, grid_wide = 0.5 * gauge.backing_width_mm, 0.5 * gauge.grid_width_mm
    for spans in gauge_spans(arm.flexure, gauge):
        for span, across in ((spans.backing, wide), (spans.grid, grid_wide)):
            start, end = sorted(arm.along(span))
            yield from rectangle((start, middle - across, end, middle + across), "NOTES")
    spans = gauge_spans(arm.flexure, gauge)[0]
    edge = middle - wide
    wanted = [
        Wanted(side="bottom", start=(a, edge), end=(b, edge))
        for a, b in (arm.along((0.0, spans.backing[0])), arm.along(spans.backing), arm.along(spans.grid))
    ]
    if arm.sign > 0.0:
        yield from in_rows(wanted, (left, base, right, middle + deep), scale)
    else:
        widths = [
            Wanted(side="left", start=(left, middle - wide), end=(left, middle + wide)),
            Wanted(side="left", start=(left, middle - grid_wide), end=(left, middle + grid_wide)),
        ]
        yield from in_rows([*wanted, *widths], (left, base, right, middle + deep), scale)
    title = f"{arm.name.upper()} UPPER LEAF"
    yield Words(text=title, at=(0.5 * (left + right), middle + deep + height), height=0.7 * height)
