"""Letters made of straight strokes, so that no installed font has a say; every stroke lies at 0, 45 or 90 degrees."""

import shapely
from shapely.ops import unary_union

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
