"""Where the strain gauges of a housing are glued, as lines of its drawing [mm]: nothing is engraved in a leaf."""

from collections.abc import Iterator

from cad.files.drafting import Item, Line, Words, across, upright
from cad.parts.housing import Housing
from cad.theory.flexure import Flexure
from cad.theory.strain_gauge import GAUGES, FoilGauge, along_leaf, gauge_spans

_ABOVE = 20.0  # of the upper leaf seen from above, over the top of the housing
_THICK = 0.25  # of a gauge seen from its edge, many times its thickness


def gauge_marks(housing: Housing) -> Iterator[Item]:
    """Yield the gauges on the profile from their edges, and on the upper leaves seen from above; none without gauges.

    Raises InputError for a leaf without room for them.
    """
    gauge = GAUGES[housing.gauges]
    if gauge is None:
        return
    for side, flexure, roots in housing.arms:
        yield from _edges(housing, flexure, roots, gauge)
        yield from _from_above(housing, flexure, roots, gauge)
        middle = housing.top_level + _ABOVE + 0.5 * flexure.depth
        words = f"{side.upper()} UPPER LEAF FROM ABOVE: GAUGE AT EACH ROOT, ON BOTH FACES"
        yield Words(text=words, at=(0.5 * sum(roots), middle + 0.5 * flexure.depth + 1.0), height=0.7)


def _edges(housing: Housing, flexure: Flexure, roots: tuple[float, float], gauge: FoilGauge) -> Iterator[Item]:
    level, half = housing.lower_leaf_level + flexure.separation, 0.5 * flexure.thickness
    for whole, _, _ in gauge_spans(flexure, gauge):
        x = along_leaf(roots, whole)
        for face in (-1.0, 1.0):
            yield from _box(x, (level + face * half, level + face * (half + _THICK)))


def _from_above(housing: Housing, flexure: Flexure, roots: tuple[float, float], gauge: FoilGauge) -> Iterator[Item]:
    middle, deep = housing.top_level + _ABOVE + 0.5 * flexure.depth, 0.5 * flexure.depth
    yield from _box(roots, (middle - deep, middle + deep), layer="PART")
    wide, grid_wide = 0.5 * gauge.backing_width_mm, 0.5 * gauge.grid_width_mm
    spans = gauge_spans(flexure, gauge)
    backing, _, grid = spans[0]
    for whole, _, sensing in spans:
        yield from _box(along_leaf(roots, whole), (middle - wide, middle + wide))
        yield from _box(along_leaf(roots, sensing), (middle - grid_wide, middle + grid_wide))
    foot = middle - deep
    for level, span, text in (
        (foot - 7.0, (0.0, backing[0]), f"{backing[0]:g}"),
        (foot - 2.0, backing, f"{gauge.backing_length_mm:g} x {gauge.backing_width_mm:g}"),
        (foot - 4.5, grid, f"grid {gauge.grid_length_mm:g} x {gauge.grid_width_mm:g}"),
    ):
        yield from across(along_leaf(roots, span), level, text, (middle - wide, middle - wide))
    yield from upright((middle - wide, middle), 0.5 * sum(roots), f"{wide:g}")


def _box(x: tuple[float, float], z: tuple[float, float], layer: str = "NOTES") -> Iterator[Item]:
    corners = ((x[0], z[0]), (x[1], z[0]), (x[1], z[1]), (x[0], z[1]))
    for start, end in zip(corners, (*corners[1:], corners[0]), strict=True):
        yield Line(start=start, end=end, layer=layer)
