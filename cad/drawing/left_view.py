"""The view of a housing from its left: plate, pad and tip, and their sizes across the section."""

import itertools
import math
from collections.abc import Iterator

from cad.drawing.items import Box, Item, Line
from cad.drawing.placing import Wanted, in_rows
from cad.drawing.sheet import rectangle
from cad.parts.housing import Housing
from cad.parts.part import NEAR_MM


def from_the_left(housing: Housing, start: float, scale: float) -> Iterator[Item]:
    """Yield the view from the left, from a place x [mm] of the sheet on: the front of the plate to its right."""
    deep, tip, top, pad = 0.5 * housing.depth, 0.5 * housing.tip_side, housing.top_level, housing.pad_height
    middle = start + pad + deep
    plate: Box = (middle - deep, housing.protrusion, middle + deep, top)
    yield from rectangle(plate, "PART")
    for side in (-1.0, 1.0):
        yield from _neck_side(housing, middle, side)
    face = Line(start=(middle - tip, 0.0), end=(middle + tip, 0.0))
    yield face
    if pad:
        yield from rectangle(_pad(housing, plate), "PART")
    wanted = [
        Wanted(side="top", start=(plate[0], top), end=(plate[2], top)),
        Wanted(side="bottom", start=face.start, end=face.end),
        *_pad_sizes(housing, plate),
    ]
    yield from in_rows(wanted, (plate[0] - pad, 0.0, plate[2], top), scale)


def _pad(housing: Housing, plate: Box) -> Box:
    """Return the pad on the back of a plate seen from the left."""
    foot = max(housing.cover_level, housing.protrusion)
    return plate[0] - housing.pad_height, foot, plate[0], housing.top_level


def _pad_sizes(housing: Housing, plate: Box) -> Iterator[Wanted]:
    """Yield height and foot of a pad; none of a plate without one."""
    if housing.pad_height:
        back, foot, face, top = _pad(housing, plate)
        yield Wanted(side="top", start=(back, top), end=(face, top))
        yield Wanted(side="left", start=(plate[0], plate[1]), end=(back, foot))


def _neck_side(housing: Housing, middle: float, side: float) -> Iterator[Line]:
    """Yield one edge of tip and taper, from the face up to the plate, where it is narrower than the plate."""
    deep, tip = middle + side * 0.5 * housing.depth, middle + side * 0.5 * housing.tip_side
    corners = [(tip, 0.0), (tip, housing.tip_height), (deep, housing.neck_level)]
    for start, end in itertools.pairwise(corners):
        if math.dist(start, end) > NEAR_MM:
            yield Line(start=start, end=end)
