"""The sheet: its size, a standard scale at which the views fit, frame, title block and notes."""

import hashlib
import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple

from cad.design.processes import Process
from cad.drawing.canvas import DECIMALS, Box, Canvas, text_width
from cad.files.file_date import given_date

SCALES = {
    "50:1": 50.0,
    "20:1": 20.0,
    "10:1": 10.0,
    "5:1": 5.0,
    "2:1": 2.0,
    "1:1": 1.0,
    "1:2": 0.5,
    "1:5": 0.2,
}  # ISO 5455
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
_DIGEST_DECIMALS = 4  # of lengths [mm] in the digest of a drawing: round-off differs between processors
_CHOICES = (
    ("A4", "50:1"),
    ("A4", "20:1"),
    ("A4", "10:1"),
    ("A4", "5:1"),
    ("A4", "2:1"),
    ("A3", "2:1"),
    ("A4", "1:1"),
    ("A3", "1:1"),
    *itertools.product(("A4", "A3", "A2"), ("1:2", "1:5")),
)
_MARGIN = Box(20.0, 10.0, 10.0, 10.0)  # of the frame from the edges of the sheet, ISO 5457
_BLOCK = Size(124.0, 48.0)  # of the title block
_LIST_ROW_MM = 6.0  # of a parts list, ISO 7573
_LIST_WIDTHS = (10.0, 10.0, 22.0, 46.0, 36.0)  # of its cells
LIST_HEADS = ("item", "count", "part", "size", "number")


@dataclass(frozen=True, kw_only=True)
class Title:
    """What stands in the corner of a drawing: the design, the process, which part it shows, its number and mass [g].

    Material, what it is made by and general tolerance are those of the process where none is given.
    """

    name: str
    process: Process
    part: str = "housing"
    number: int = 1
    mass_g: float | None = None
    material: str = ""
    made_by: str = ""
    tolerance: str = ""

    @property
    def drawing_number(self) -> str:
        """Return the number of the drawing."""
        return f"{self.name}-{self.number:02d}"

    @property
    def general_tolerance(self) -> str:
        """Return the tolerance of what no dimension says otherwise [mm]."""
        of_process = "ISO 2768-1 m" if self.process.kind == "dmls" else f"±{GENERAL_MM:g}"
        return self.tolerance or of_process


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
        dxf.write_text(self.canvas.dxf(), encoding="utf-8", newline="")
        self.canvas.write_svg(svg, self.window)
        return dxf, svg


def on_sheet(
    draw_views: Callable[[Canvas], None],
    notes: Sequence[str],
    title: Title,
    parts: Sequence[Sequence[str]] = (),
) -> Sheet:
    """Return the smallest sheet with the largest scale on which the views fit.

    They stand above title block and notes, or above the notes and beside the title block with the list of parts on it,
    whose rows have a text for each of LIST_HEADS.
    """
    list_height = _LIST_ROW_MM * (len(parts) + 1) if parts else 0.0
    notes_height = _NOTE_STEP_MM * (len(notes) + 1)
    decimals = 1 if title.general_tolerance.startswith("±") else DECIMALS
    canvas = Canvas(max(SCALES.values()), decimals=decimals)
    draw_views(canvas)
    least = canvas.extents()  # texts and gaps are of a size on paper: at any smaller scale they take more of the part
    for size, scale in _CHOICES:
        paper = SIZES[size]
        left = _MARGIN.left + _ROOM_MM
        right = paper.width - _MARGIN.right - _ROOM_MM
        top = paper.height - _MARGIN.top - _ROOM_MM
        over_block = _MARGIN.bottom + max(_BLOCK.height + list_height, notes_height) + _ROOM_MM
        over_notes = _MARGIN.bottom + notes_height + _ROOM_MM
        rooms = (Box(left, over_block, right, top), Box(left, over_notes, right - _BLOCK.width, top))
        if not _that_hold(rooms, least, SCALES[scale]) and (size, scale) != _CHOICES[-1]:
            continue
        if canvas.scale != SCALES[scale]:
            canvas = Canvas(SCALES[scale], decimals=decimals)
            draw_views(canvas)
        views = canvas.extents()
        fitting = _that_hold(rooms, views, canvas.scale)
        if fitting:
            break
    free = fitting[0] if fitting else rooms[0]
    # The sheet is laid around the views, in the middle of what is free, so that they keep their places.
    left = 0.5 * (views.left + views.right - (free.left + free.right) / canvas.scale)
    bottom = 0.5 * (views.bottom + views.top - (free.bottom + free.top) / canvas.scale)
    window = Box(left, bottom, left + paper.width / canvas.scale, bottom + paper.height / canvas.scale)
    on_paper = canvas.paper((left, bottom))
    _draw_frame(on_paper, paper, notes)
    for number, row in enumerate([LIST_HEADS, *parts] if parts else []):
        base = _MARGIN.bottom + _BLOCK.height + number * _LIST_ROW_MM
        cells = [_Cell("", text, width) for text, width in zip(row, _LIST_WIDTHS, strict=True)]
        _draw_row(on_paper, paper, cells, base, _LIST_ROW_MM)
    # Nobody counts the changes of a design, so the digest of what is told tells whether two prints are the same.
    texts = [text for text, _ in canvas.texts()]
    lengths = [round(float(length.get_measurement()), _DIGEST_DECIMALS) for length in canvas.dimensions()]
    revision = hashlib.sha256(f"{replace(title, mass_g=None)}{texts}{lengths}".encode()).hexdigest()[:8]
    _draw_title(on_paper, paper, _title_rows(title, size, scale, revision))
    return Sheet(canvas=canvas, size=size, scale=scale, window=window)


def _that_hold(rooms: Sequence[Box], views: Box, scale: float) -> list[Box]:
    """Return the rooms [mm of paper] that are large enough for views [mm of the part] at a scale."""
    width = scale * (views.right - views.left)
    height = scale * (views.top - views.bottom)
    return [room for room in rooms if width <= room.right - room.left and height <= room.top - room.bottom]


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
    row_height = _BLOCK.height / len(rows)
    for number, row in enumerate(reversed(rows)):
        _draw_row(paper, size, row, _MARGIN.bottom + number * row_height, row_height)
    _draw_first_angle(paper, size.width - _MARGIN.right - 10.0, _MARGIN.bottom + 3.2)


def _draw_row(paper: Canvas, size: Size, cells: Sequence[_Cell], base: float, row_height: float) -> None:
    """Draw a row of cells from a level on, each with what it is, if that is told, above its text."""
    right = size.width - _MARGIN.right
    x = right - _BLOCK.width
    top = base + row_height
    for level in (base, top):
        paper.line((x, level), (right, level), "SHEET")
    for cell in cells:
        tallest = 3.0 if cell.head else 2.0
        height = min(tallest, (cell.width - 3.0) / text_width(cell.text or " ", 1.0))  # the text fits into its cell
        paper.line((x, base), (x, top), "SHEET")
        if cell.head:
            paper.words(cell.head, (x + 1.0, top - 2.0), 1.4, "NOTES", from_the_left=True)
        paper.words(cell.text, (x + 1.5, base + (3.8 if cell.head else 3.0)), height, "SHEET", from_the_left=True)
        x += cell.width


def _title_rows(title: Title, size: str, scale: str, revision: str) -> tuple[Sequence[_Cell], ...]:
    date = given_date()
    to_sign = (
        _Cell("legal owner", "", 44.0),
        _Cell("created by", "", 40.0),
        _Cell("approved by", "", 40.0),
    )  # ISO 7200
    return (
        (_Cell("part", f"{title.name}: {title.part}", _BLOCK.width),),
        to_sign,
        (
            _Cell("number", title.drawing_number, 62.0),
            _Cell("revision", revision, 22.0),
            _Cell("mass", "" if title.mass_g is None else f"{title.mass_g:.3g} g", 40.0),
        ),
        (
            _Cell("material", title.material or title.process.material, 62.0),
            _Cell("process", title.made_by or title.process.name, 62.0),
        ),
        (
            _Cell("general tolerance", title.general_tolerance, 40.0),
            _Cell("scale", scale, 18.0),
            _Cell("sheet", f"{size} 1/1", 20.0),
            _Cell("date", date.strftime("%Y-%m-%d") if date else "", 26.0),
            _Cell("first angle", "", 20.0),
        ),
    )


def _draw_first_angle(paper: Canvas, x: float, y: float) -> None:
    """Draw the symbol of first-angle projection, ISO 5456-2: a cone, and to its right its small end in front."""
    small_top, small_foot = (x - 7.0, y + 1.3), (x - 7.0, y - 1.3)
    large_top, large_foot = (x - 2.0, y + 2.6), (x - 2.0, y - 2.6)
    outline = [small_foot, small_top, large_top, large_foot, small_foot]
    for start, end in itertools.pairwise(outline):
        paper.line(start, end, "SHEET")
    paper.circle((x + 4.0, y), 1.3, "SHEET")
    paper.circle((x + 4.0, y), 2.6, "SHEET")
