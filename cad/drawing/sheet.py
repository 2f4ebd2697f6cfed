"""The sheet: its size, a standard scale at which the views fit, frame, title block and notes."""

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from cad.design.processes import Process
from cad.drawing.canvas import Box, Canvas, text_width
from cad.files.file_date import given_date

SCALES = {"2:1": 2.0, "1:1": 1.0, "1:2": 0.5, "1:5": 0.2}  # ISO 5455
GENERAL_MM = 0.2  # what no dimension says otherwise: the accuracy of a printed part in print-service guides
BETWEEN_MM = 14.0  # on paper, between the dimensions of one view and the next
_NOTE_MM = 2.0  # height of a note
_NOTE_STEP_MM = 4.0  # from one note to the next
_ROOM_MM = 4.0  # between views and frame


class Size(NamedTuple):
    """Width and height [mm]."""

    width: float
    height: float


SIZES = {"A4": Size(297.0, 210.0), "A3": Size(420.0, 297.0), "A2": Size(594.0, 420.0)}  # ISO 216, landscape
_CHOICES = (("A4", "2:1"), ("A3", "2:1"), *itertools.product(SIZES, ("1:1", "1:2", "1:5")))
_MARGIN = Box(20.0, 10.0, 10.0, 10.0)  # of the frame from the edges of the sheet, ISO 5457
_BLOCK = Size(124.0, 48.0)  # of the title block


@dataclass(frozen=True, kw_only=True)
class Title:
    """What stands in the corner of a drawing: the design, the process, which part it shows, its number and mass [g]."""

    name: str
    process: Process
    part: str = "housing"
    number: int = 1
    mass_g: float | None = None


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
        canvas = Canvas(SCALES[scale], decimals=1 if title.process.kind != "dmls" else 2)
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
    left = 0.5 * (views.left + views.right - (free.left + free.right) / canvas.scale)
    bottom = 0.5 * (views.bottom + views.top - (free.bottom + free.top) / canvas.scale)
    window = Box(left, bottom, left + paper.width / canvas.scale, bottom + paper.height / canvas.scale)
    on_paper = canvas.paper((left, bottom))
    _draw_frame(on_paper, paper, notes)
    _draw_title(on_paper, paper, _title_rows(title, size, scale))
    return Sheet(canvas=canvas, size=size, scale=scale, window=window)


def _draw_frame(paper: Canvas, size: Size, notes: Sequence[str]) -> None:
    """Draw the edge of the sheet, the frame, and the notes in its lower left corner."""
    paper.rectangle(Box(0.0, 0.0, size.width, size.height), "NOTES")
    frame = Box(_MARGIN.left, _MARGIN.bottom, size.width - _MARGIN.right, size.height - _MARGIN.top)
    paper.rectangle(frame, "SHEET")
    level = frame.bottom + 4.0
    for note in reversed(notes):
        paper.words(note, (frame.left + 4.0, level), _NOTE_MM, "NOTES", from_the_left=True)
        level += _NOTE_STEP_MM


class _Cell(NamedTuple):
    """A cell of the title block: what it is, what stands there, how wide it is [mm of paper]."""

    head: str
    text: str
    width: float


def _draw_title(paper: Canvas, size: Size, rows: Sequence[Sequence[_Cell]]) -> None:
    """Draw the title block: rows of cells, each with what it is above what stands in it."""
    right = size.width - _MARGIN.right
    left = right - _BLOCK.width
    top = _MARGIN.bottom + _BLOCK.height
    paper.rectangle(Box(left, _MARGIN.bottom, right, top), "SHEET")
    row_height = _BLOCK.height / len(rows)
    for row in rows:
        base = top - row_height
        paper.line((left, base), (right, base), "SHEET")
        x = left
        for cell in row:
            height = min(3.0, (cell.width - 3.0) / text_width(cell.text or " ", 1.0))  # the text fits into its cell
            paper.words(cell.head, (x + 1.0, top - 2.0), 1.4, "NOTES", from_the_left=True)
            paper.words(cell.text, (x + 1.5, base + 3.8), height, "SHEET", from_the_left=True)
            x += cell.width
            paper.line((x, base), (x, top), "SHEET")
        top = base
    _draw_first_angle(paper, right - 10.0, _MARGIN.bottom + 4.0)


def _title_rows(title: Title, size: str, scale: str) -> tuple[tuple[_Cell, ...], ...]:
    process = title.process
    date = given_date()
    return (
        (_Cell("part", f"{title.name}: {title.part}", _BLOCK.width),),
        (
            _Cell("number", f"{title.name}-{title.number:02d}", 62.0),
            _Cell("revision", "A", 22.0),
            _Cell("mass", "" if title.mass_g is None else f"{title.mass_g:.3g} g", 40.0),
        ),
        (_Cell("material", process.material, 62.0), _Cell("process", process.name, 62.0)),
        (
            _Cell("general tolerance", general_tolerance(process), 40.0),
            _Cell("scale", scale, 18.0),
            _Cell("sheet", f"{size} 1/1", 20.0),
            _Cell("date", date.strftime("%Y-%m-%d") if date else "", 26.0),
            _Cell("first angle", "", 20.0),
        ),
    )


def _draw_first_angle(paper: Canvas, x: float, y: float) -> None:
    """Draw the symbol of first-angle projection, ISO 5456-2: a cone, and to its right its small end in front."""
    small_top, small_foot = (x - 8.0, y + 1.5), (x - 8.0, y - 1.5)
    large_top, large_foot = (x - 2.0, y + 3.0), (x - 2.0, y - 3.0)
    outline = [small_foot, small_top, large_top, large_foot, small_foot]
    for start, end in itertools.pairwise(outline):
        paper.line(start, end, "SHEET")
    paper.circle((x + 4.0, y), 1.5, "SHEET")
    paper.circle((x + 4.0, y), 3.0, "SHEET")
