"""The sheet of a drawing: size and standard scale at which the views fit, frame, title block, table and notes."""

import hashlib
import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple

from cad.drawing.canvas import DECIMALS, Box, Canvas, Point, text_width
from cad.drawing.measuring_table import GENERAL_MM
from cad.files.file_date import given_date
from sensor.design.processes import Process

SCALES = {"2:1": 2.0, "1:1": 1.0, "1:2": 0.5, "1:5": 0.2}  # ISO 5455
BETWEEN_MM = 14.0  # distance between the dimensions of neighbouring views, on paper
_NOTE_MM = 2.0  # text height of a note
_NOTE_STEP_MM = 4.0  # distance between lines of notes
_NOTE_MARGIN_MM = 4.0  # distance from the frame to the notes, and between their columns
_ROOM_MM = 4.0  # smallest distance of a view from frame, table and notes
_NEAR = 1e-6  # round-off of a comparison of two positions [mm]


class Size(NamedTuple):
    """Width and height [mm]."""

    width: float
    height: float


SIZES = {"A4": Size(297.0, 210.0), "A3": Size(420.0, 297.0), "A2": Size(594.0, 420.0)}  # ISO 216, landscape
_DIGEST_DECIMALS = 4  # decimals of lengths [mm] in the digest of a drawing, because round-off differs by processor
# Sizes and scales in the order in which they are tried.
_CHOICES = (
    ("A4", "2:1"),
    ("A3", "2:1"),
    ("A4", "1:1"),
    ("A3", "1:1"),
    ("A2", "1:1"),
    *itertools.product(("A4", "A3", "A2"), ("1:2", "1:5")),
)
_MARGIN = Box(20.0, 10.0, 10.0, 10.0)  # margins between frame and edges of the sheet, ISO 5457
_BLOCK = Size(124.0, 48.0)  # size of the title block
_ROW_MM = 5.0  # height of a row in the table above the title block
_CELLS_MM = (7.0, 47.0, 12.0, 13.0, 23.0)  # widths of the printed cells of a row
_MEASURED_MM = _BLOCK.width - sum(_CELLS_MM)  # width of the empty cells of a row, for measured values
_TABLE_LETTER_MM = 2.0  # text height in the table
_TITLE_LETTER_MM = 3.0  # text height in the title block
_HEAD_LETTER_MM = 1.4  # text height of the heads in the title block
_UNDER_HEAD_MM = 3.8  # height of the middle of a text under a head above the foot of its cell


@dataclass(frozen=True, kw_only=True)
class Title:
    """The contents of the title block: name of the design, print process, and mass of the housing [g]."""

    name: str
    process: Process
    mass_g: float | None = None

    @property
    def general_tolerance(self) -> str:
        """Return the tolerance of dimensions without one of their own, as text [mm]."""
        return "ISO 2768-1 m" if self.process.is_metal else f"±{GENERAL_MM:g}"

    @property
    def decimals(self) -> int:
        """Return the number of decimals of lengths, limited by the tolerance of a plastic print."""
        return DECIMALS if self.process.is_metal else 1


class Table(NamedTuple):
    """A table to be filled in by hand.

    `heads` and `rows` are printed texts; `to_fill` are the heads of the empty columns to their right.
    """

    heads: Sequence[str]
    to_fill: Sequence[str]
    rows: Sequence[Sequence[str]]

    @property
    def height(self) -> float:
        """Return the height on paper [mm]."""
        return _ROW_MM * (1 + len(self.rows))


@dataclass(frozen=True, kw_only=True)
class Sheet:
    """A drawing on its sheet: size, scale, and the window of the drawing that the sheet covers [mm of the part]."""

    canvas: Canvas
    size: str
    scale: str
    window: Box

    def write(self, path: Path) -> tuple[Path, ...]:
        """Write the sheet as DXF, SVG and PDF files next to `path`, and return their paths; raises OSError."""
        dxf, svg, pdf = (path.with_suffix(suffix) for suffix in (".dxf", ".svg", ".pdf"))
        dxf.write_text(self.canvas.dxf(), encoding="utf-8", newline="")
        self.canvas.write_svg(svg, self.window)
        self.canvas.write_pdf(pdf, self.window)
        return dxf, svg, pdf


def lay_out_sheet(
    draw_views: Callable[[Canvas], tuple[Table, Sequence[Box]]], notes: Sequence[str], title: Title
) -> Sheet:
    """Return the first sheet of `_CHOICES` on which the views fit, with frame, table, title block and notes.

    `draw_views` draws the views on a canvas, and returns the table and the bounding box of each view [mm]. The table is
    placed above the title block in the lower right corner, and the notes in the lower left one.
    """
    layout = _first_layout_that_fits(draw_views, notes, title)
    canvas = layout.drawn.canvas
    paper = SIZES[layout.size]
    left, bottom = layout.corner
    window = Box(left, bottom, left + paper.width / canvas.scale, bottom + paper.height / canvas.scale)
    paper_canvas = canvas.paper(layout.corner)
    _draw_frame(paper_canvas, paper, notes)
    _draw_table(paper_canvas, paper, layout.drawn.table)
    _draw_title(paper_canvas, paper, _title_rows(title, layout.size, layout.scale, _revision(canvas, title)))
    return Sheet(canvas=canvas, size=layout.size, scale=layout.scale, window=window)


class _ScaledViews(NamedTuple):
    """The views drawn at one scale: their canvas, the table of the sheet, and the bounding box of each view [mm]."""

    canvas: Canvas
    table: Table
    views: Sequence[Box]


class _Layout(NamedTuple):
    """A sheet with views on it: the names of size and scale, the views, and the lower left corner of the sheet.

    The corner is in coordinates of the drawing [mm of the part], because the sheet is placed around the views.
    """

    size: str
    scale: str
    drawn: _ScaledViews
    corner: Point


def _first_layout_that_fits(
    draw_views: Callable[[Canvas], tuple[Table, Sequence[Box]]], notes: Sequence[str], title: Title
) -> _Layout:
    """Return the first layout of `_CHOICES` in which nothing overlaps; the arguments are as in `lay_out_sheet`.

    If there is none, return the last choice, with its lower left corner at that of the views.
    """
    by_scale: dict[str, _ScaledViews] = {}
    for size, scale in _CHOICES:
        if scale not in by_scale:
            canvas = Canvas(SCALES[scale], decimals=title.decimals)
            by_scale[scale] = _ScaledViews(canvas, *draw_views(canvas))
        scaled_views = by_scale[scale]
        corner = _sheet_corner(SIZES[size], scaled_views, notes)
        if corner is not None:
            return _Layout(size, scale, scaled_views, corner)
    return _Layout(
        size, scale, scaled_views, (scaled_views.views[0].left, min(view.bottom for view in scaled_views.views))
    )


def _revision(canvas: Canvas, title: Title) -> str:
    """Return the revision of a drawing: eight hexadecimal digits of a hash of its texts and lengths.

    Equal drawings have equal revisions. A running number is impossible, because changes of a design are not counted.
    """
    texts = [text for text, _ in canvas.texts()]
    lengths = [round(float(length.get_measurement()), _DIGEST_DECIMALS) for length in canvas.dimensions()]
    return hashlib.sha256(f"{replace(title, mass_g=None)}{texts}{lengths}".encode()).hexdigest()[:8]


def _sheet_corner(paper: Size, drawn: _ScaledViews, notes: Sequence[str]) -> Point | None:
    """Return the lower left corner of a sheet in the drawing [mm], or None if the views overlap anything on the sheet.

    Three positions of the views on the sheet are tried. Boxes are in mm of paper from the lower left corner of the
    sheet.
    """
    scale = drawn.canvas.scale
    frame = _frame_of(paper)
    columns, lines = _note_columns(paper, notes)
    note_width = columns * (_note_width(notes) + _NOTE_MARGIN_MM)
    note_box = Box(frame.left, frame.bottom, frame.left + note_width, frame.bottom + _NOTE_STEP_MM * (lines + 1))
    block_top = frame.bottom + _BLOCK.height + drawn.table.height
    block = Box(frame.right - _BLOCK.width, frame.bottom, frame.right, block_top)
    if _boxes_overlap(note_box, block):
        return None
    usable = Box(frame.left + _ROOM_MM, frame.bottom + _ROOM_MM, frame.right - _ROOM_MM, frame.top - _ROOM_MM)
    views = Box(*(scale * side for side in _bounding_box(drawn.views)))
    centre_x = 0.5 * (views.left + views.right)
    centre_y = 0.5 * (views.bottom + views.top)
    # Shifts of the views to the right and up; the corner of the sheet lies at the negative shift in the drawing.
    shifts = (
        # centred in the area above table and notes
        (0.5 * (usable.left + usable.right) - centre_x, 0.5 * (max(block.top, note_box.top) + usable.top) - centre_y),
        # centred in the area above the notes, left of the table
        (0.5 * (usable.left + block.left) - centre_x, 0.5 * (note_box.top + usable.top) - centre_y),
        # in the upper left corner
        (usable.left - views.left, usable.top - views.top),
    )
    for shift_x, shift_y in shifts:
        shifted_views = [
            Box(
                scale * box.left + shift_x,
                scale * box.bottom + shift_y,
                scale * box.right + shift_x,
                scale * box.top + shift_y,
            )
            for box in drawn.views
        ]
        is_clear = not any(
            _boxes_overlap(box, occupied, _ROOM_MM) for box in shifted_views for occupied in (note_box, block)
        )
        if is_clear and _is_within(_bounding_box(shifted_views), usable):
            return -shift_x / scale, -shift_y / scale
    return None


def _frame_of(paper: Size) -> Box:
    """Return the frame of a sheet [mm of paper]."""
    return Box(_MARGIN.left, _MARGIN.bottom, paper.width - _MARGIN.right, paper.height - _MARGIN.top)


def _note_width(notes: Sequence[str]) -> float:
    """Return the width of the longest note [mm of paper]."""
    return max(text_width(note, _NOTE_MM) for note in notes)


def _note_columns(paper: Size, notes: Sequence[str]) -> tuple[int, int]:
    """Return the number of columns of notes that fit beside the title block, at least one, and of lines per column."""
    width = paper.width - _MARGIN.left - _MARGIN.right - _BLOCK.width
    columns = max(1, int(width // (_note_width(notes) + _NOTE_MARGIN_MM)))
    return columns, math.ceil(len(notes) / columns)


def _bounding_box(boxes: Sequence[Box]) -> Box:
    """Return the smallest box that encloses all boxes [mm]."""
    left, bottom, right, top = zip(*boxes, strict=True)
    return Box(min(left), min(bottom), max(right), max(top))


def _is_within(box: Box, outer: Box) -> bool:
    """Return whether a box lies inside another one, `outer`, within round-off [mm]."""
    is_within_width = box.left >= outer.left - _NEAR and box.right <= outer.right + _NEAR
    return is_within_width and box.bottom >= outer.bottom - _NEAR and box.top <= outer.top + _NEAR


def _boxes_overlap(box: Box, other: Box, gap: float = 0.0) -> bool:
    """Return whether two boxes overlap or are separated by less than `gap` [mm]."""
    is_beside = box.left >= other.right + gap - _NEAR or other.left >= box.right + gap - _NEAR
    return not is_beside and box.bottom < other.top + gap - _NEAR and other.bottom < box.top + gap - _NEAR


def _draw_frame(paper: Canvas, size: Size, notes: Sequence[str]) -> None:
    """Draw the edge of the sheet, its frame, and the notes in columns from the lower left corner of the frame."""
    paper.rectangle(Box(0.0, 0.0, size.width, size.height), "NOTES")
    frame = _frame_of(size)
    paper.rectangle(frame, "SHEET")
    _, lines = _note_columns(size, notes)
    step = _note_width(notes) + _NOTE_MARGIN_MM
    for number, note in enumerate(notes):
        column, line = divmod(number, lines)
        position = (frame.left + _NOTE_MARGIN_MM + column * step, frame.bottom + _NOTE_STEP_MM * (lines - line))
        paper.write_text(note, position, _NOTE_MM, "NOTES", from_the_left=True)


class _Cell(NamedTuple):
    """A cell of the title block or the table: its head, its text and its width [mm of paper]."""

    head: str
    text: str
    width: float


def _draw_title(paper: Canvas, size: Size, rows: Sequence[Sequence[_Cell]]) -> None:
    """Draw the title block: rows of cells with heads above their texts, and the symbol of first-angle projection."""
    row_height = _BLOCK.height / len(rows)
    for number, row in enumerate(reversed(rows)):
        _draw_row(paper, size, row, _MARGIN.bottom + number * row_height, row_height)
    _draw_first_angle(paper, size.width - _MARGIN.right - 10.0, _MARGIN.bottom + 3.2)


def _draw_table(paper: Canvas, size: Size, table: Table) -> None:
    """Draw the table above the title block, with its heads on top and empty cells for measured values on the right."""
    widths = (*_CELLS_MM, *[_MEASURED_MM / len(table.to_fill)] * len(table.to_fill))
    empty = [""] * len(table.to_fill)
    rows = [[*table.heads, *table.to_fill], *([*row, *empty] for row in table.rows)]
    for number, texts in enumerate(reversed(rows)):
        cells = [_Cell("", text, width) for text, width in zip(texts, widths, strict=True)]
        _draw_row(paper, size, cells, _MARGIN.bottom + _BLOCK.height + number * _ROW_MM, _ROW_MM)


def _draw_row(paper: Canvas, size: Size, cells: Sequence[_Cell], base: float, row_height: float) -> None:
    """Draw a row of cells, as wide as the title block, with its lower edge at the height `base` [mm of paper].

    The head of a cell stands in small letters above its text. Without a head, the text is centred in the height of the
    cell. Margins of 1 to 2.5 mm were chosen by eye.
    """
    right = size.width - _MARGIN.right
    x = right - _BLOCK.width
    top = base + row_height
    for edge in (base, top):
        paper.line((x, edge), (right, edge), "SHEET")
    for cell in cells:
        largest = _TITLE_LETTER_MM if cell.head else _TABLE_LETTER_MM
        height = min(largest, (cell.width - 2.5) / text_width(cell.text or " ", 1.0))  # long texts get small letters
        paper.line((x, base), (x, top), "SHEET")
        if cell.head:
            paper.write_text(cell.head, (x + 1.0, top - 2.0), _HEAD_LETTER_MM, "NOTES", from_the_left=True)
        text_level = base + (_UNDER_HEAD_MM if cell.head else 0.5 * row_height)
        if cell.text:
            paper.write_text(cell.text, (x + 1.5, text_level), height, "SHEET", from_the_left=True)
        x += cell.width


def _title_rows(title: Title, size: str, scale: str, revision: str) -> tuple[Sequence[_Cell], ...]:
    """Return the rows of the title block from the top, with the data fields of ISO 7200.

    Three cells are left empty for handwriting.
    """
    date = given_date()
    empty_cells = (
        _Cell("legal owner", "", 44.0),
        _Cell("created by", "", 40.0),
        _Cell("approved by", "", 40.0),
    )
    return (
        (_Cell("part", f"{title.name}: housing", _BLOCK.width),),
        empty_cells,
        (
            _Cell("number", f"{title.name}-01", 62.0),
            _Cell("revision", revision, 22.0),
            _Cell("mass", "" if title.mass_g is None else f"{title.mass_g:.3g} g", 40.0),
        ),
        (
            _Cell("material", title.process.material, 62.0),
            _Cell("process", title.process.name, 62.0),
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
    """Draw the symbol of first-angle projection, ISO 5456-2, about a point [mm of paper].

    It shows a truncated cone from the side, and to the right its two circles from the small end. The cone is 5 mm long
    with diameters of 2.6 and 5.2 mm; the standard leaves the size of the symbol to the sheet.
    """
    small_top, small_foot = (x - 7.0, y + 1.3), (x - 7.0, y - 1.3)
    large_top, large_foot = (x - 2.0, y + 2.6), (x - 2.0, y - 2.6)
    outline = [small_foot, small_top, large_top, large_foot, small_foot]
    for start, end in itertools.pairwise(outline):
        paper.line(start, end, "SHEET")
    paper.circle((x + 4.0, y), 1.3, "SHEET")
    paper.circle((x + 4.0, y), 2.6, "SHEET")
