"""The sheet: its size, a standard scale at which the views fit, frame, title block and notes."""

import itertools
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

from cad.design.processes import Process
from cad.drawing.items import FULL_DEG, LETTER, Arc, Box, Item, Line, Point, Words, union
from cad.files.file_date import given_date

SIZES = {"A4": (297.0, 210.0), "A3": (420.0, 297.0), "A2": (594.0, 420.0)}  # [mm], ISO 216, landscape
SCALES = {"2:1": 2.0, "1:1": 1.0, "1:2": 0.5, "1:5": 0.2}  # ISO 5455
_CHOICES = (("A4", "2:1"), ("A3", "2:1"), *itertools.product(SIZES, ("1:1", "1:2", "1:5")))
_EDGES = (20.0, 10.0, 10.0, 10.0)  # left, bottom, right, top of the frame from the edges of the sheet, ISO 5457
_BLOCK = (124.0, 36.0)  # of the title block
_NOTE_MM, _NOTE_STEP_MM = 2.0, 4.0
_ROOM = 4.0  # between views and frame
GENERAL_MM = 0.2  # what no dimension says otherwise: the accuracy of a printed part in print-service guides
_GENERAL = {"dmls": "ISO 2768-1 m"}


@dataclass(frozen=True, kw_only=True)
class Title:
    """What stands in the corner of a drawing: the design, the process, and which part it shows."""

    name: str
    process: Process
    part: str = "housing"


@dataclass(frozen=True, kw_only=True)
class Sheet:
    """A drawing on its sheet [mm of the part]: items, size, scale, and the window that the sheet is."""

    items: tuple[Item, ...]
    title: Title
    size: str
    scale: str
    window: Box

    @property
    def factor(self) -> float:
        """Return millimetres of paper over those of the part [1]."""
        return SCALES[self.scale]


def general_tolerance(process: Process) -> str:
    """Return the tolerance of what no dimension says otherwise [mm]."""
    return _GENERAL.get(process.kind, f"±{GENERAL_MM:g}")


def on_sheet(views: Callable[[float], Sequence[Item]], notes: Sequence[str], title: Title) -> Sheet:
    """Return the smallest sheet with the largest scale on which the views fit, above title block and notes."""
    below = max(_BLOCK[1], _NOTE_STEP_MM * (len(notes) + 1)) + _EDGES[1]
    for size, scale in _CHOICES:
        items, free = tuple(views(SCALES[scale])), _free(size, below)
        box = union([item.box for item in items])
        if all(SCALES[scale] * side <= room for side, room in zip(_sides(box), _sides(free), strict=True)):
            break
    # The sheet is laid around the views, in the middle of what is free, so that they keep their places.
    origin = _origin(box, free, SCALES[scale])
    paper = (*_frame(*SIZES[size]), *_block(title, size, scale), *_notes(notes))
    placed = tuple(_moved(item, origin, SCALES[scale]) for item in paper)
    window = _window(origin, size, SCALES[scale])
    return Sheet(items=(*items, *placed), title=title, size=size, scale=scale, window=window)


def _window(origin: Point, size: str, factor: float) -> Box:
    """Return the edges of the sheet [mm of the part] whose corner is at the origin."""
    width, height = SIZES[size]
    return origin[0], origin[1], origin[0] + width / factor, origin[1] + height / factor


def _free(size: str, below: float) -> Box:
    """Return what frame, title block and notes leave of a sheet for the views [mm of paper]."""
    (width, height), (left, _, right, top) = SIZES[size], _EDGES
    return left + _ROOM, below + _ROOM, width - right - _ROOM, height - top - _ROOM


def _sides(box: Box) -> Point:
    return box[2] - box[0], box[3] - box[1]


def _origin(box: Box, free: Box, factor: float) -> Point:
    """Return where the corner of the sheet stands [mm of the part], with the views in the middle of what is free."""
    x, y = (0.5 * (box[i] + box[i + 2] - (free[i] + free[i + 2]) / factor) for i in (0, 1))
    return x, y


def _moved(item: Line | Arc | Words, origin: Point, factor: float) -> Item:
    """Return an item of the paper [mm of it] where it stands around the part."""

    def place(point: Point) -> Point:
        return origin[0] + point[0] / factor, origin[1] + point[1] / factor

    if isinstance(item, Line):
        return Line(start=place(item.start), end=place(item.end), layer=item.layer)
    if isinstance(item, Arc):
        centre, radius = place(item.centre), item.radius / factor
        return Arc(centre=centre, radius=radius, start=item.start, end=item.end, layer=item.layer)
    height = item.height / factor
    return Words(text=item.text, at=place(item.at), height=height, centred=item.centred, layer=item.layer)


def rectangle(box: Box, layer: str) -> Iterator[Line]:
    """Yield the four sides of a box."""
    left, bottom, right, top = box
    corners = [(left, bottom), (right, bottom), (right, top), (left, top), (left, bottom)]
    for start, end in itertools.pairwise(corners):
        yield Line(start=start, end=end, layer=layer)


def _frame(width: float, height: float) -> Iterator[Line]:
    """Yield the edge of the sheet and its frame [mm of paper]."""
    left, bottom, right, top = _EDGES
    yield from rectangle((0.0, 0.0, width, height), "NOTES")
    yield from rectangle((left, bottom, width - right, height - top), "SHEET")


def _notes(notes: Sequence[str]) -> Iterator[Words]:
    left, bottom = _EDGES[:2]
    for count, note in enumerate(reversed(notes)):
        at = (left + 4.0, bottom + 4.0 + _NOTE_STEP_MM * count)
        yield Words(text=note, at=at, height=_NOTE_MM, centred=False, layer="NOTES")


def _block(title: Title, size: str, scale: str) -> Iterator[Line | Arc | Words]:
    """Yield the title block [mm of paper]: rows of cells, each with what it is above what stands in it."""
    wide, high = _BLOCK
    x0, y0, rows = SIZES[size][0] - _EDGES[2] - wide, _EDGES[1], _rows(title, size, scale)
    step = high / len(rows)
    yield from rectangle((x0, y0, x0 + wide, y0 + high), "SHEET")
    for count, row in enumerate(rows):
        base, x = y0 + high - step * (count + 1), x0
        yield Line(start=(x0, base), end=(x0 + wide, base), layer="SHEET")
        for head, text, room in row:
            yield from _cell((x, base), step, head, text, room)
            x += room
    yield from _first_angle((x0 + wide - 10.0, y0 + 4.0))


def _rows(title: Title, size: str, scale: str) -> tuple[tuple[tuple[str, str, float], ...], ...]:
    """Return the cells of the title block by row: what it is, what stands there, how wide it is [mm of paper]."""
    process, date = title.process, given_date()
    day = date.strftime("%Y-%m-%d") if date else ""
    return (
        (("part", f"{title.name}: {title.part}", _BLOCK[0]),),
        (("material", process.material, 62.0), ("process", process.name, 62.0)),
        (
            ("general tolerance", general_tolerance(process), 40.0),
            ("scale", scale, 18.0),
            ("sheet", f"{size} 1/1", 20.0),
            ("date", day, 26.0),
            ("first angle", "", 20.0),
        ),
    )


def _cell(corner: Point, high: float, head: str, text: str, room: float) -> Iterator[Line | Words]:
    """Yield one cell from its lower left corner: its head, its text as large as there is room, its right edge."""
    x, base = corner
    yield Words(text=head, at=(x + 1.0, base + high - 2.0), height=1.4, centred=False, layer="NOTES")
    height = min(3.0, (room - 3.0) / (LETTER * max(1, len(text))))
    yield Words(text=text, at=(x + 1.5, base + 3.8), height=height, centred=False, layer="SHEET")
    yield Line(start=(x + room, base), end=(x + room, base + high), layer="SHEET")


def _first_angle(middle: Point) -> Iterator[Line | Arc]:
    """Yield the symbol of first-angle projection, ISO 5456-2: a cone, and to its right its small end in front."""
    x, y = middle
    ends = ((x - 8.0, 1.5), (x - 2.0, 3.0))
    for place, half in ends:
        yield Line(start=(place, y - half), end=(place, y + half), layer="SHEET")
    for side in (-1.0, 1.0):
        (a, small), (b, large) = ends
        yield Line(start=(a, y + side * small), end=(b, y + side * large), layer="SHEET")
    for radius in (1.5, 3.0):
        yield Arc(centre=(x + 4.0, y), radius=radius, start=0.0, end=FULL_DEG, layer="SHEET")
