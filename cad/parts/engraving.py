"""Marks on the frame, where nothing bends: L and H beside the springs and the design's name on the bar above.

They are engraved in the face that lies up in print pose, y = -depth / 2, and read from there; in a plate of a square in
the pads of its back. Letters are made of straight strokes at 0, 45 or 90 degrees, so that no installed font has a say.
"""

from __future__ import annotations

import cadquery as cq
import shapely
from shapely.ops import unary_union

from cad.parts.housing import ENGRAVED_MM, SETBACK_MM, Housing
from cad.parts.part import NEAR_MM, Part, named_part, on_plane, same_as

PEN_MM = 0.5  # the widest of the least gaps of the processes
TALLEST_MM, SMALLEST_MM = 4.0, 3.0  # smaller letters would leave walls under 0.8 mm between their strokes
_EDGE_MM = 1.0  # left free around a text
_PAD_EDGE_MM = 0.95  # the same on the bar of a pad: the widest of the least walls, and the corners of oblique strokes
_MARKED = "side_faces"  # of the housing, which the marks lie on


def marked(part: Part, housing: Housing, name: str) -> Part:
    """Return the housing with L, H and a name (letters, digits, - and _) engraved 0.3 mm deep; named faces stay.

    A name that is too long is cut short; a place that is too small for letters of 3 mm stays blank.
    """
    wall = 0.5 * housing.wall_width
    middle = 0.5 * (housing.protrusion + housing.top_level)
    bar, room = _bar(housing)
    beside = (housing.wall_width, housing.top_level - housing.protrusion - 4.0 * housing.hole_inset)
    tools = [
        *_tools(name, bar, room, housing),
        *_tools("L", (housing.left + wall, middle), beside, housing),
        *_tools("H", (housing.right - wall, middle), beside, housing),
    ]
    if not tools:
        return part
    return _renamed(part, part.shape.cut(*tools), 0.5 * housing.depth)


def _bar(housing: Housing) -> tuple[tuple[float, float], tuple[float, float]]:
    """Return the middle (x, z) of the bar, or of the pad on it between the dowels, and its width and height [mm]."""
    foot = housing.cavity_level
    width, height = housing.right - housing.left - 2.0 * housing.wall_width, housing.top_level - foot
    if housing.back_to_back:
        width, height = width - 4.0 * housing.dowel_hole, height - SETBACK_MM + 2.0 * (_EDGE_MM - _PAD_EDGE_MM)
        foot = foot + SETBACK_MM
    return (0.5 * (housing.left + housing.right), 0.5 * (foot + housing.top_level)), (width, height)


def _tools(text: str, centre: tuple[float, float], room: tuple[float, float], housing: Housing) -> list[cq.Solid]:
    """Return what is cut away for a text at a place (x, z), in a room of that width and height [mm]."""
    height = min(TALLEST_MM, room[1] - PEN_MM - 2.0 * _EDGE_MM)
    if height < SMALLEST_MM:
        return []
    fitting = letters_that_fit(text, height, room[0] - PEN_MM - 2.0 * _EDGE_MM)
    areas = outlines(fitting, height, PEN_MM) if fitting else ()
    if housing.back_to_back:
        return [_tool(area, centre, 0.5 * housing.depth + housing.pad_height, -1.0) for area in areas]
    return [_tool(area, centre, -0.5 * housing.depth, 1.0) for area in areas]


def _tool(area: shapely.Polygon, centre: tuple[float, float], face: float, sign: float) -> cq.Solid:
    """Return what an area takes away at a face; the sign -1 mirrors it, to be read from the side +y."""

    def wire(ring: shapely.LinearRing) -> cq.Wire:
        points = [cq.Vector(centre[0] + sign * x, face - ENGRAVED_MM, centre[1] + z) for x, z in ring.coords[:-1]]
        return cq.Wire.makePolygon(points, close=True)

    outer, inner = wire(area.exterior), [wire(ring) for ring in area.interiors]
    return cq.Solid.extrudeLinear(outer, inner, cq.Vector(0.0, 2.0 * ENGRAVED_MM, 0.0))


def _renamed(part: Part, shape: cq.Shape, half_depth: float) -> Part:
    """Return the part with another shape whose named faces are those at the same places with the same areas.

    The sides of the plate, at the half depth [mm], lose what the marks take away.
    """
    every = part.shape.Faces()
    tests = {name: same_as([every[i] for i in indices], NEAR_MM) for name, indices in part.faces.items()}
    if _MARKED in tests:
        front, back = (on_plane(1, side * half_depth) for side in (-1.0, 1.0))
        tests[_MARKED] = lambda face: front(face) or back(face)
    return named_part(part.name, shape.Solids()[0] if len(shape.Solids()) == 1 else shape, tests)


Stroke = tuple[tuple[float, float], ...]
_TALL, _STEP, _GAP = 6, 7, 3  # grid units from foot to top; a letter is 4 wide

# Each stroke is a row of two-digit points, x then y, on a grid 4 wide and 6 tall.
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


def strokes(text: str, height: float) -> tuple[Stroke, ...]:
    """Return the strokes [mm] of a text whose letters are so high [mm], the whole centred on the origin.

    Capitals stand for all letters. Raises KeyError for a sign that has no strokes.
    """
    unit = height / _TALL
    left = -0.5 * unit * (_STEP * len(text) - _GAP)
    found = []
    for place, letter in enumerate(text.upper()):
        start = left + place * _STEP * unit
        for stroke in _STROKES[letter].split(", "):
            points = [(int(point[0]), int(point[1])) for point in stroke.split(" ")]
            found.append(tuple((start + unit * x, unit * y - 0.5 * height) for x, y in points))
    return tuple(found)


def outlines(text: str, height: float, width: float) -> tuple[shapely.Polygon, ...]:
    """Return the areas [mm] that a pen of the given width covers, from left to right."""
    lines = [shapely.LineString(stroke) for stroke in strokes(text, height)]
    inked = unary_union([line.buffer(0.5 * width, cap_style="square", join_style="mitre") for line in lines])
    pieces = [inked] if isinstance(inked, shapely.Polygon) else list(inked.geoms)
    return tuple(sorted(pieces, key=lambda piece: piece.bounds))


def letters_that_fit(text: str, height: float, room: float) -> str:
    """Return as much of a text as a room [mm] holds."""
    unit = height / _TALL
    return text[: max(0, int((room + _GAP * unit) // (_STEP * unit)))]
