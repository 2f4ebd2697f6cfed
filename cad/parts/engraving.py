"""Marks engraved on the frame: L and H beside the springs, and the name of the design on the bar above them.

The frame does not bend, so the marks do not affect the springs. The marks are on the face that is up in print: the face
y = -depth / 2, or the pads at the back of a back-to-back plate. The letters consist of straight strokes, so they
do not depend on installed fonts.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import cadquery as cq
import shapely

from cad.parts.housing import ENGRAVED_MM, SETBACK_MM, Housing, Point
from cad.parts.housing_solid import named_housing
from cad.parts.part import Part

PEN_MM = 0.5  # width of a stroke, which is the largest `min_gap_mm` of all processes
TALLEST_MM = 4.0  # largest height of letters
# Smallest height of letters. In smaller letters, the walls between strokes would be thinner than 0.8 mm.
SMALLEST_MM = 3.0
_EDGE_MM = 1.0  # blank margin around a text
_PAD_EDGE_MM = 0.95  # blank margin on a pad: the largest `min_wall_mm`, plus room for the corners of oblique strokes


class _Panel(NamedTuple):
    """A rectangle on the frame that is reserved for one text: its centre (x, z), its width and its height [mm]."""

    x: float
    z: float
    width: float
    height: float


def engrave_name(part: Part, housing: Housing, name: str) -> Part:
    """Engrave L, H and a name into the solid of a housing, 0.3 mm deep, and return the engraved part.

    L and H mark the walls of the low and the high spring. `name` consists of letters, digits, - and _. If it is too
    long, it is truncated. A panel that is too small for letters of 3 mm is left blank. The named faces of the part are
    kept.
    """
    left_wall, right_wall = _wall_panels(housing)
    cutters: list[cq.Solid] = []
    for text, panel in ((name, _name_panel(housing)), ("L", left_wall), ("H", right_wall)):
        # The strokes are wider than their centre lines by half a pen on each side, and a margin remains beside them.
        letter_height = min(TALLEST_MM, panel.height - PEN_MM - 2.0 * _EDGE_MM)
        if letter_height >= SMALLEST_MM:
            text_width = panel.width - PEN_MM - 2.0 * _EDGE_MM
            areas = outlines(truncate_to_width(text, letter_height, text_width), letter_height, PEN_MM)
            cutters += [_engraving_cutter(area, panel, housing) for area in areas]
    if not cutters:
        return part
    return named_housing(part.shape.cut(*cutters), housing)


def _wall_panels(housing: Housing) -> list[_Panel]:
    """Return the panels on the left and the right wall. Each is between the two screw holes of its wall.

    The distance of a panel from the centres of the holes is the distance of the holes from the edges of the frame.
    """
    panels = []
    for arm in housing.arms:
        (x, lower_z), (_, upper_z) = arm.holes
        height = upper_z - lower_z - 2.0 * housing.hole_inset
        panels.append(_Panel(x, 0.5 * (lower_z + upper_z), housing.wall_width, height))
    return panels


def _name_panel(housing: Housing) -> _Panel:
    """Return the panel for the name, which is on the bar above the springs, or on the pad that covers this bar."""
    lower_level = housing.cavity_level
    width = housing.right - housing.left - 2.0 * housing.wall_width
    height = housing.top_level - lower_level
    if housing.back_to_back:
        # A dowel hole is centred one diameter beside each post. The panel begins two diameters beside it.
        width -= 4.0 * housing.back_to_back.dowel_hole
        # The pad is set back from the cavity. The panel is larger than the pad by the difference of the two margins,
        # because `engrave_name` subtracts the larger one.
        height = height - SETBACK_MM + 2.0 * (_EDGE_MM - _PAD_EDGE_MM)
        lower_level += SETBACK_MM
    return _Panel(0.5 * (housing.left + housing.right), 0.5 * (lower_level + housing.top_level), width, height)


def _engraving_cutter(area: shapely.Polygon, panel: _Panel, housing: Housing) -> cq.Solid:
    """Return the solid that is cut from the frame to engrave an area [mm].

    `area` is given in x and z, relative to the centre of the `panel`. On the back of a plate, x is mirrored, so that
    the text can be read from behind. The solid extends as far out of the face as into it, because a cutter that ends
    exactly in the face could leave a thin layer.
    """
    if housing.back_to_back:
        x_sign = -1.0
        face_y = 0.5 * housing.depth + housing.back_to_back.pad_height
    else:
        x_sign = 1.0
        face_y = -0.5 * housing.depth

    start_y = face_y - ENGRAVED_MM  # the solid is extruded from here to face_y + ENGRAVED_MM

    def make_wire(ring: shapely.LinearRing) -> cq.Wire:
        """Return a closed wire at y = `start_y`. The last point of a ring, a copy of the first, is omitted."""
        points = [cq.Vector(panel.x + x_sign * x, start_y, panel.z + z) for x, z in ring.coords[:-1]]
        return cq.Wire.makePolygon(points, close=True)

    holes = [make_wire(ring) for ring in area.interiors]
    return cq.Solid.extrudeLinear(make_wire(area.exterior), holes, cq.Vector(0.0, 2.0 * ENGRAVED_MM, 0.0))


Stroke = tuple[Point, ...]
# These sizes are in units of the grid on which the letters are drawn.
_LETTER_HEIGHT = 6
_GAP = 3  # gap between letters
_STEP = 7  # distance from one letter to the next: a width of 4 and a gap

# Commas separate the strokes of a letter. Each point of a stroke has two digits, x from 0 to 4 and y from 0 to 6.
_STROKES = {
    "A": "00 04 26 44 40, 02 42", "B": "00 06 36 45 44 33 03, 33 42 41 30 00", "C": "45 36 16 05 01 10 30 41",
    "D": "00 06 26 44 42 20 00", "E": "46 06 00 40, 03 33", "F": "46 06 00, 03 33",
    "G": "45 36 16 05 01 10 30 41 43 33", "H": "00 06, 40 46, 03 43", "I": "20 26, 10 30, 16 36",
    "J": "01 10 30 41 46", "K": "00 06, 46 13 40, 03 13", "L": "06 00 40", "M": "00 06 24 46 40",
    "N": "00 06, 05 41, 40 46", "O": "10 01 05 16 36 45 41 30 10", "P": "00 06 36 45 44 33 03",
    "Q": "10 01 05 16 36 45 41 30 10, 31 40", "R": "00 06 36 45 44 33 03, 13 40",
    "S": "45 36 16 05 04 13 33 42 41 30 10 01", "T": "20 26, 06 46", "U": "06 01 10 30 41 46",
    "V": "06 02 20 42 46", "W": "06 00 22 40 46", "X": "06 05 41 40, 00 01 45 46", "Y": "06 05 23 45 46, 23 20",
    "Z": "06 46 45 01 00 40", "0": "00 06 46 40 00", "1": "15 26 20, 10 30", "2": "05 16 36 45 44 00 40",
    "3": "05 16 36 45 44 33 23, 33 42 41 30 10 01", "4": "30 36 03 02 42", "5": "46 06 03 33 42 41 30 00",
    "6": "36 16 05 01 10 30 41 42 33 03", "7": "06 46 45 23 20", "8": "13 04 05 16 36 45 44 33 13 02 01 10 30 41 42 33",
    "9": "10 30 41 45 36 16 05 04 13 43", "-": "13 33", "_": "00 40",
}  # fmt: skip


def strokes(text: str, height: float) -> Sequence[Stroke]:
    """Return the strokes of a text in capital letters, each as a sequence of points [mm].

    `height` [mm] is the height of the letters, and the text is centred on the origin. Raises KeyError for a character
    that is not in the alphabet of `_STROKES`.
    """
    unit = height / _LETTER_HEIGHT  # length of a grid unit [mm]
    left = -0.5 * unit * (_STEP * len(text) - _GAP)  # left edge of the text, whose last letter has no gap behind it
    strokes_mm = []
    for index, letter in enumerate(text.upper()):
        letter_x = left + index * _STEP * unit  # left edge of the letter [mm]
        for stroke in _STROKES[letter].split(", "):
            points = [(int(digits[0]), int(digits[1])) for digits in stroke.split(" ")]  # x and y in grid units
            strokes_mm.append(tuple((letter_x + unit * x, unit * y - 0.5 * height) for x, y in points))
    return strokes_mm


def outlines(text: str, height: float, width: float) -> Sequence[shapely.Polygon]:
    """Return the areas [mm] that a text covers if it is drawn with a square pen, ordered from left to right.

    `height` [mm] is the height of the letters, and `width` [mm] the width of the pen.
    """
    lines = [shapely.LineString(stroke) for stroke in strokes(text, height)]
    covered = shapely.union_all([line.buffer(0.5 * width, cap_style="square", join_style="mitre") for line in lines])
    return sorted(shapely.get_parts(covered), key=lambda piece: piece.bounds)


def truncate_to_width(text: str, height: float, width: float) -> str:
    """Return the first letters of a text that fit into a width [mm] if the letters have the given height [mm]."""
    unit = height / _LETTER_HEIGHT
    return text[: max(0, int((width + _GAP * unit) // (_STEP * unit)))]
