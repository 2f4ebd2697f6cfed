"""The sheet: its size, a standard scale at which the views fit, frame, title block and notes."""

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from cad.design.processes import Process
from cad.drawing.canvas import LETTER, Box, Canvas, Point
from cad.files.file_date import given_date

SCALES = {"2:1": 2.0, "1:1": 1.0, "1:2": 0.5, "1:5": 0.2}  # ISO 5455
GENERAL_MM = 0.2  # what no dimension says otherwise: the accuracy of a printed part in print-service guides
BETWEEN_MM = 14.0  # on paper, between the dimensions of one view and the next
_NOTE_MM, _NOTE_STEP_MM = 2.0, 4.0
_ROOM_MM = 4.0  # between views and frame


class Size(NamedTuple):
    """Width and height [mm]."""

    width: float
    height: float


SIZES = {"A4": Size(297.0, 210.0), "A3": Size(420.0, 297.0), "A2": Size(594.0, 420.0)}  # ISO 216, landscape
_CHOICES = (("A4", "2:1"), ("A3", "2:1"), *itertools.product(SIZES, ("1:1", "1:2", "1:5")))
_MARGIN = Box(20.0, 10.0, 10.0, 10.0)  # of the frame from the edges of the sheet, ISO 5457
_BLOCK = Size(124.0, 36.0)  # of the title block


@dataclass(frozen=True, kw_only=True)
class Title:
    """What stands in the corner of a drawing: the design, the process, and which part it shows."""

    name: str
    process: Process
    part: str = "housing"


@dataclass(frozen=True, kw_only=True)
class Sheet:
    """A drawing on its sheet: size, scale, and the window that the sheet is [mm of the part]."""

    canvas: Canvas
    size: str
    scale: str
    window: Box

    def write(self, path: Path) -> tuple[Path, Path]:
        """Write the sheet as DXF and as SVG; return their paths; raises OSError."""
        dxf = path.with_suffix(".dxf")
        svg = path.with_suffix(".svg")
        self.canvas.write_dxf(dxf)
        self.canvas.write_svg(svg, self.window)
        return dxf, svg


def general_tolerance(process: Process) -> str:
    """Return the tolerance of what no dimension says otherwise [mm]."""
    return "ISO 2768-1 m" if process.kind == "dmls" else f"±{GENERAL_MM:g}"


def on_sheet(draw_views: Callable[[Canvas], None], notes: Sequence[str], title: Title) -> Sheet:
    """Return the smallest sheet with the largest scale on which the views fit, above title block and notes."""
    below = _MARGIN.bottom + max(_BLOCK.height, _NOTE_STEP_MM * (len(notes) + 1))
    for size, scale in _CHOICES:
        canvas = Canvas(SCALES[scale])
        draw_views(canvas)
        views = canvas.extents()
        paper = SIZES[size]
        free = Box(
            _MARGIN.left + _ROOM_MM,
            below + _ROOM_MM,
            paper.width - _MARGIN.right - _ROOM_MM,
            paper.height - _MARGIN.top - _ROOM_MM,
        )
        fits_across = canvas.scale * (views.right - views.left) <= free.right - free.left
        if fits_across and canvas.scale * (views.top - views.bottom) <= free.top - free.bottom:
            break
    # The sheet is laid around the views, in the middle of what is free, so that they keep their places.
    corner = (
        0.5 * (views.left + views.right - (free.left + free.right) / canvas.scale),
        0.5 * (views.bottom + views.top - (free.bottom + free.top) / canvas.scale),
    )
    _draw_paper(_Paper(canvas, corner), paper, title, (size, scale), notes)
    window = Box(*corner, corner[0] + paper.width / canvas.scale, corner[1] + paper.height / canvas.scale)
    return Sheet(canvas=canvas, size=size, scale=scale, window=window)


class _Paper:
    """Draws on a canvas in millimetres of the paper from its lower left corner."""

    def __init__(self, canvas: Canvas, corner: Point) -> None:
        self._canvas = canvas
        self._corner = corner

    def _at(self, x: float, y: float) -> Point:
        return self._corner[0] + x / self._canvas.scale, self._corner[1] + y / self._canvas.scale

    def line(self, start: Point, end: Point) -> None:
        self._canvas.line(self._at(*start), self._at(*end), "SHEET")

    def rectangle(self, box: Box, layer: str = "SHEET") -> None:
        self._canvas.rectangle(Box(*self._at(box.left, box.bottom), *self._at(box.right, box.top)), layer)

    def circle(self, centre: Point, radius: float) -> None:
        self._canvas.circle(self._at(*centre), radius / self._canvas.scale, "SHEET")

    def words(self, text: str, at: Point, height: float, layer: str = "SHEET") -> None:
        self._canvas.words(text, self._at(*at), height / self._canvas.scale, layer, from_the_left=True)


def _draw_paper(paper: _Paper, size: Size, title: Title, format_and_scale: Sequence[str], notes: Sequence[str]) -> None:
    """Draw edge, frame, notes and title block: rows of cells, each with what it is above what stands in it."""
    paper.rectangle(Box(0.0, 0.0, *size), "NOTES")
    paper.rectangle(Box(_MARGIN.left, _MARGIN.bottom, size.width - _MARGIN.right, size.height - _MARGIN.top))
    for count, note in enumerate(reversed(notes)):
        at = (_MARGIN.left + 4.0, _MARGIN.bottom + 4.0 + _NOTE_STEP_MM * count)
        paper.words(note, at, _NOTE_MM, "NOTES")

    left = size.width - _MARGIN.right - _BLOCK.width
    right = left + _BLOCK.width
    rows = _title_rows(title, *format_and_scale)
    row_height = _BLOCK.height / len(rows)
    paper.rectangle(Box(left, _MARGIN.bottom, right, _MARGIN.bottom + _BLOCK.height))
    for count, row in enumerate(rows):
        base = _MARGIN.bottom + _BLOCK.height - row_height * (count + 1)
        paper.line((left, base), (right, base))
        x = left
        for cell in row:
            height = min(3.0, (cell.width - 3.0) / (LETTER * max(1, len(cell.text))))
            paper.words(cell.head, (x + 1.0, base + row_height - 2.0), 1.4, "NOTES")
            paper.words(cell.text, (x + 1.5, base + 3.8), height)
            x += cell.width
            paper.line((x, base), (x, base + row_height))
    _draw_first_angle(paper, right - 10.0, _MARGIN.bottom + 4.0)


class _Cell(NamedTuple):
    """A cell of the title block: what it is, what stands there, how wide it is [mm of paper]."""

    head: str
    text: str
    width: float


def _title_rows(title: Title, size: str, scale: str) -> tuple[tuple[_Cell, ...], ...]:
    process = title.process
    date = given_date()
    return (
        (_Cell("part", f"{title.name}: {title.part}", _BLOCK.width),),
        (_Cell("material", process.material, 62.0), _Cell("process", process.name, 62.0)),
        (
            _Cell("general tolerance", general_tolerance(process), 40.0),
            _Cell("scale", scale, 18.0),
            _Cell("sheet", f"{size} 1/1", 20.0),
            _Cell("date", date.strftime("%Y-%m-%d") if date else "", 26.0),
            _Cell("first angle", "", 20.0),
        ),
    )


def _draw_first_angle(paper: _Paper, x: float, y: float) -> None:
    """Draw the symbol of first-angle projection, ISO 5456-2: a cone, and to its right its small end in front."""
    paper.line((x - 8.0, y - 1.5), (x - 8.0, y + 1.5))
    paper.line((x - 2.0, y - 3.0), (x - 2.0, y + 3.0))
    paper.line((x - 8.0, y - 1.5), (x - 2.0, y - 3.0))
    paper.line((x - 8.0, y + 1.5), (x - 2.0, y + 3.0))
    paper.circle((x + 4.0, y), 1.5)
    paper.circle((x + 4.0, y), 3.0)
