"""The sheet of a drawing: its size, a standard scale at which the views fit, and its frame, title block and notes."""

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
_NOTE_MARGIN_MM = 4.0  # distance from the frame to the notes, and between columns of notes
_CLEARANCE_MM = 4.0  # smallest distance from a view to the frame, the table and the notes
_NEAR_MM = 1e-6  # tolerance for round-off when two positions are compared


class Size(NamedTuple):
    """A width and a height [mm]."""

    width: float
    height: float


SIZES = {"A4": Size(297.0, 210.0), "A3": Size(420.0, 297.0), "A2": Size(594.0, 420.0)}  # ISO 216, landscape
_DIGEST_DECIMALS = 4  # number of decimals of lengths [mm] in the revision hash; round-off depends on the processor
# The combinations of size and scale, in the order in which they are tried.
_CHOICES = (
    ("A4", "2:1"),
    ("A3", "2:1"),
    ("A4", "1:1"),
    ("A3", "1:1"),
    ("A2", "1:1"),
    *itertools.product(("A4", "A3", "A2"), ("1:2", "1:5")),
)
_MARGIN = Box(20.0, 10.0, 10.0, 10.0)  # margins between the frame and the edges of the sheet, ISO 5457
_BLOCK = Size(124.0, 48.0)  # size of the title block
_ROW_MM = 5.0  # height of a row of the table above the title block
_CELLS_MM = (7.0, 47.0, 12.0, 13.0, 23.0)  # widths of the printed cells of a row
_MEASURED_MM = _BLOCK.width - sum(_CELLS_MM)  # total width of the empty cells of a row, for measured values
_TABLE_LETTER_MM = 2.0  # text height in the table
_HEADING_LETTER_MM = 1.4  # text height of the headings in the title block
_TITLE_LETTER_MM = 3.0  # text height in the title block
_UNDER_HEADING_MM = 3.8  # height of a text under a heading: from the bottom of its cell to the middle of the text


@dataclass(frozen=True, kw_only=True)
class Title:
    """The contents of the title block: name of the design, print process, and mass of the housing [g]."""

    name: str
    process: Process
    mass_g: float | None = None

    @property
    def general_tolerance(self) -> str:
        """Return the general tolerance, which applies to dimensions without a tolerance of their own, as text [mm]."""
        return "ISO 2768-1 m" if self.process.is_metal else f"±{GENERAL_MM:g}"

    @property
    def decimals(self) -> int:
        """Return the number of decimals of lengths; one is enough for the tolerance of a plastic print."""
        return DECIMALS if self.process.is_metal else 1


class Table(NamedTuple):
    """A table to be filled in by hand.

    `headings` and `rows` are printed. `blank_headings` are the headings of the empty columns to their right.
    """

    headings: Sequence[str]
    blank_headings: Sequence[str]
    rows: Sequence[Sequence[str]]

    @property
    def height(self) -> float:
        """Return the height of the table on paper [mm], including the row of headings."""
        return _ROW_MM * (1 + len(self.rows))


@dataclass(frozen=True, kw_only=True)
class Sheet:
    """A drawing on its sheet: size, scale, and the window of the drawing that the sheet covers [mm on the part]."""

    canvas: Canvas
    size: str
    scale: str
    window: Box

    def write(self, path: Path) -> tuple[Path, ...]:
        """Write the sheet as DXF, SVG and PDF files, and return their paths.

        The suffix of `path` is replaced for each file. Raises OSError if a file cannot be written.
        """
        dxf, svg, pdf = (path.with_suffix(suffix) for suffix in (".dxf", ".svg", ".pdf"))
        dxf.write_text(self.canvas.dxf(), encoding="utf-8", newline="")
        self.canvas.write_svg(svg, self.window)
        self.canvas.write_pdf(pdf, self.window)
        return dxf, svg, pdf


def lay_out_sheet(
    draw_views: Callable[[Canvas], tuple[Table, Sequence[Box]]], notes: Sequence[str], title: Title
) -> Sheet:
    """Return the drawing on the first sheet on which its views fit, with frame, table, title block and notes.

    Sheets from A4 to A2 are tried at standard scales. `draw_views` draws the views on a canvas, and returns the table
    and the bounding box of each view [mm]. The title block is in the lower right corner, below the table. The `notes`,
    one string per line, are in the lower left corner. `title` holds the contents of the title block.
    """
    layout = _first_layout_that_fits(draw_views, notes, title)
    canvas = layout.scaled_views.canvas
    paper = SIZES[layout.size]
    left, bottom = layout.corner
    # The window is the area of the sheet in drawing coordinates, so sizes on paper are divided by the scale.
    window = Box(left, bottom, left + paper.width / canvas.scale, bottom + paper.height / canvas.scale)
    paper_canvas = canvas.add_paper_canvas(layout.corner)
    _draw_frame(paper_canvas, paper, notes)
    _draw_table(paper_canvas, paper, layout.scaled_views.table)
    # The revision is computed before the title block is drawn, because the title block shows it.
    revision = _revision(canvas, title)
    _draw_title(paper_canvas, paper, _title_rows(title, layout.size, layout.scale, revision))
    return Sheet(canvas=canvas, size=layout.size, scale=layout.scale, window=window)


class _ScaledViews(NamedTuple):
    """All views drawn at one scale: their canvas, the table of the sheet, and the bounding box of each view [mm]."""

    canvas: Canvas
    table: Table
    views: Sequence[Box]


class _Layout(NamedTuple):
    """A choice of sheet: its size, its scale, the views at this scale, and the lower left corner of the sheet.

    The corner is in drawing coordinates [mm on the part], because the sheet is placed around the views.
    """

    size: str
    scale: str
    scaled_views: _ScaledViews
    corner: Point


def _first_layout_that_fits(
    draw_views: Callable[[Canvas], tuple[Table, Sequence[Box]]], notes: Sequence[str], title: Title
) -> _Layout:
    """Return the first layout, of all choices of size and scale, in which views, table and notes do not overlap.

    `draw_views` draws the views on a canvas, and returns the table and the bounding box of each view [mm]. If there is
    no such layout, the layout tried last is returned, with the views in the lower left corner of the sheet.
    """
    views_by_scale: dict[str, _ScaledViews] = {}
    for size, scale in _CHOICES:
        if scale not in views_by_scale:  # sheets of different sizes share the views at one scale
            canvas = Canvas(SCALES[scale], decimals=title.decimals)
            table, boxes = draw_views(canvas)
            views_by_scale[scale] = _ScaledViews(canvas, table, boxes)
        scaled_views = views_by_scale[scale]
        corner = _sheet_corner(SIZES[size], scaled_views, notes)
        if corner is not None:
            return _Layout(size, scale, scaled_views, corner)
    # The first view is the section, which is at the left.
    lower_left = (scaled_views.views[0].left, min(view.bottom for view in scaled_views.views))
    return _Layout(size, scale, scaled_views, lower_left)


def _revision(canvas: Canvas, title: Title) -> str:
    """Return the revision of a drawing: the first eight hexadecimal digits of a hash of its title, texts and lengths.

    Identical drawings have identical revisions. The mass is not part of the hash. Consecutive numbers are impossible,
    because changes to a design are not counted.
    """
    texts = [text for text, _ in canvas.find_texts()]
    measured_lengths = [
        round(float(dimension.get_measurement()), _DIGEST_DECIMALS) for dimension in canvas.dimensions()
    ]
    contents = f"{replace(title, mass_g=None)}{texts}{measured_lengths}"
    return hashlib.sha256(contents.encode()).hexdigest()[:8]


def _sheet_corner(paper: Size, scaled_views: _ScaledViews, notes: Sequence[str]) -> Point | None:
    """Return the lower left corner of a sheet in the drawing [mm], or None if the views do not fit on the sheet.

    `paper` [mm] is the size of the sheet, and `notes` are its notes, one string per line. Three positions of the views
    on the sheet are tried. All boxes are in millimetres on paper, measured from the lower left corner of the sheet.
    """
    scale = scaled_views.canvas.scale
    frame = _frame_of(paper)
    note_box = _note_box(paper, notes)
    block_top = frame.bottom + _BLOCK.height + scaled_views.table.height
    table_box = Box(frame.right - _BLOCK.width, frame.bottom, frame.right, block_top)
    if _boxes_overlap(note_box, table_box):
        return None
    # The area in which views may lie.
    usable = Box(
        frame.left + _CLEARANCE_MM, frame.bottom + _CLEARANCE_MM, frame.right - _CLEARANCE_MM, frame.top - _CLEARANCE_MM
    )
    # The views before any shift: the origin of the drawing is then at the lower left corner of the sheet.
    all_views = Box(*(scale * side for side in _bounding_box(scaled_views.views)))
    for shift_x, shift_y in _shifts_to_try(all_views, usable, note_box, table_box):
        shifted_views = [_box_on_paper(view, scale, shift_x, shift_y) for view in scaled_views.views]
        if _views_fit(shifted_views, usable, (note_box, table_box)):
            # A shift of the views moves the corner of the sheet the other way in the drawing.
            return -shift_x / scale, -shift_y / scale
    return None


def _views_fit(views: Sequence[Box], usable: Box, obstacles: Sequence[Box]) -> bool:
    """Return whether all views lie in the usable area, and keep their clearance from the obstacles [mm on paper]."""
    overlaps_obstacle = any(
        _boxes_overlap(view, obstacle, _CLEARANCE_MM) for view, obstacle in itertools.product(views, obstacles)
    )
    return _is_within(_bounding_box(views), usable) and not overlaps_obstacle


def _box_on_paper(box: Box, scale: float, shift_x: float, shift_y: float) -> Box:
    """Return the box on paper of a box in the drawing [mm], shifted to the right and up [mm on paper]."""
    return Box(
        scale * box.left + shift_x,
        scale * box.bottom + shift_y,
        scale * box.right + shift_x,
        scale * box.top + shift_y,
    )


def _shifts_to_try(views: Box, usable: Box, note_box: Box, table_box: Box) -> tuple[Point, ...]:
    """Return three shifts (right, up) of the views on a sheet [mm on paper], in the order in which they are tried.

    `views` is the bounding box of all views before the shift. `usable` is the area inside the frame. `table_box` is the
    box of the title block and the table above it.
    """
    centre_x = 0.5 * (views.left + views.right)
    centre_y = 0.5 * (views.bottom + views.top)
    return (
        # centred in the area above the table and the notes
        (
            0.5 * (usable.left + usable.right) - centre_x,
            0.5 * (max(table_box.top, note_box.top) + usable.top) - centre_y,
        ),
        # centred in the area above the notes and left of the table
        (0.5 * (usable.left + table_box.left) - centre_x, 0.5 * (note_box.top + usable.top) - centre_y),
        # in the upper left corner
        (usable.left - views.left, usable.top - views.top),
    )


def _note_box(paper: Size, notes: Sequence[str]) -> Box:
    """Return the box of the notes in the lower left corner of the frame [mm on paper]."""
    frame = _frame_of(paper)
    columns, lines = _note_columns(paper, notes)
    note_width = columns * (_note_width(notes) + _NOTE_MARGIN_MM)
    return Box(frame.left, frame.bottom, frame.left + note_width, frame.bottom + _NOTE_STEP_MM * (lines + 1))


def _frame_of(paper: Size) -> Box:
    """Return the frame of a sheet [mm on paper]."""
    return Box(_MARGIN.left, _MARGIN.bottom, paper.width - _MARGIN.right, paper.height - _MARGIN.top)


def _note_width(notes: Sequence[str]) -> float:
    """Return the width of the longest note [mm on paper]."""
    return max(text_width(note, _NOTE_MM) for note in notes)


def _note_columns(paper: Size, notes: Sequence[str]) -> tuple[int, int]:
    """Return the number of columns of notes beside the title block, and the number of lines in a full column.

    There are as many columns as fit, but at least one.
    """
    width = paper.width - _MARGIN.left - _MARGIN.right - _BLOCK.width
    columns = max(1, int(width // (_note_width(notes) + _NOTE_MARGIN_MM)))
    return columns, math.ceil(len(notes) / columns)


def _bounding_box(boxes: Sequence[Box]) -> Box:
    """Return the smallest box that encloses all boxes [mm]."""
    left, bottom, right, top = zip(*boxes, strict=True)
    return Box(min(left), min(bottom), max(right), max(top))


def _is_within(box: Box, outer: Box) -> bool:
    """Return whether a box lies inside the box `outer`, with a tolerance for round-off."""
    is_within_width = box.left >= outer.left - _NEAR_MM and box.right <= outer.right + _NEAR_MM
    return is_within_width and box.bottom >= outer.bottom - _NEAR_MM and box.top <= outer.top + _NEAR_MM


def _boxes_overlap(box: Box, other: Box, gap: float = 0.0) -> bool:
    """Return whether two boxes overlap, or are less than `gap` [mm] apart."""
    is_beside = box.left >= other.right + gap - _NEAR_MM or other.left >= box.right + gap - _NEAR_MM
    return not is_beside and box.bottom < other.top + gap - _NEAR_MM and other.bottom < box.top + gap - _NEAR_MM


def _draw_frame(paper: Canvas, size: Size, notes: Sequence[str]) -> None:
    """Draw the edge of the sheet, its frame, and the notes, in columns from the lower left corner of the frame."""
    paper.rectangle(Box(0.0, 0.0, size.width, size.height), "NOTES")
    frame = _frame_of(size)
    paper.rectangle(frame, "SHEET")
    _, lines = _note_columns(size, notes)  # lines in a full column
    step = _note_width(notes) + _NOTE_MARGIN_MM
    for number, note in enumerate(notes):
        column, line = divmod(number, lines)
        # Line 0 is the top line, so its height above the frame is largest.
        position = (frame.left + _NOTE_MARGIN_MM + column * step, frame.bottom + _NOTE_STEP_MM * (lines - line))
        paper.write_text(note, position, _NOTE_MM, "NOTES", left_aligned=True)


class _Cell(NamedTuple):
    """A cell of the title block or the table: its heading, its text and its width [mm on paper]."""

    heading: str
    text: str
    width: float


def _draw_title(paper: Canvas, size: Size, rows: Sequence[Sequence[_Cell]]) -> None:
    """Draw the title block: rows of cells with headings above their texts, and the symbol of first-angle projection."""
    row_height = _BLOCK.height / len(rows)
    for number, row in enumerate(reversed(rows)):  # the last row is drawn first, at the bottom
        _draw_row(paper, size, row, _MARGIN.bottom + number * row_height, row_height)
    # The symbol is in the middle of the lower right cell, which is 20 mm wide. The height of the symbol, 3.2 mm, was
    # chosen by eye.
    _draw_first_angle_symbol(paper, size.width - _MARGIN.right - 10.0, _MARGIN.bottom + 3.2)


def _draw_table(paper: Canvas, size: Size, table: Table) -> None:
    """Draw the table above the title block: headings at the top, empty cells for measured values on the right."""
    blank_count = len(table.blank_headings)
    widths = (*_CELLS_MM, *[_MEASURED_MM / blank_count] * blank_count)
    blanks = [""] * blank_count
    rows = [[*table.headings, *table.blank_headings], *([*row, *blanks] for row in table.rows)]
    for number, texts in enumerate(reversed(rows)):  # the last row is drawn first, at the bottom
        cells = [_Cell("", text, width) for text, width in zip(texts, widths, strict=True)]
        _draw_row(paper, size, cells, _MARGIN.bottom + _BLOCK.height + number * _ROW_MM, _ROW_MM)


def _draw_row(paper: Canvas, size: Size, cells: Sequence[_Cell], base: float, row_height: float) -> None:
    """Draw a row of cells, as wide as the title block, with its lower edge at the height `base` [mm on paper].

    `size` is the size of the sheet, and `row_height` [mm on paper] is the height of the row. The heading of a cell is
    written in small letters above its text. If there is no heading, the text is centred in the height of the cell. The
    margins of 1 to 2.5 mm were chosen by eye.
    """
    right = size.width - _MARGIN.right
    x = right - _BLOCK.width  # the left edge of the first cell
    top = base + row_height
    for edge in (base, top):
        paper.line((x, edge), (right, edge), "SHEET")
    for cell in cells:
        largest_height = _TITLE_LETTER_MM if cell.heading else _TABLE_LETTER_MM
        # A long text is written in smaller letters, so that it fits into its cell.
        letter_height = min(largest_height, (cell.width - 2.5) / text_width(cell.text or " ", 1.0))
        paper.line((x, base), (x, top), "SHEET")
        if cell.heading:
            paper.write_text(cell.heading, (x + 1.0, top - 2.0), _HEADING_LETTER_MM, "NOTES", left_aligned=True)
        text_middle = _UNDER_HEADING_MM if cell.heading else 0.5 * row_height  # height of the text above the lower edge
        if cell.text:
            paper.write_text(cell.text, (x + 1.5, base + text_middle), letter_height, "SHEET", left_aligned=True)
        x += cell.width


def _title_rows(title: Title, size: str, scale: str, revision: str) -> tuple[Sequence[_Cell], ...]:
    """Return the rows of the title block from top to bottom, with the data fields of ISO 7200.

    `size` and `scale` are the names of the sheet size and the scale, such as A4 and 1:2. Three cells are left empty, to
    be filled in by hand.
    """
    date = given_date()
    date_text = date.strftime("%Y-%m-%d") if date else ""
    mass_text = "" if title.mass_g is None else f"{title.mass_g:.3g} g"
    # The widths of the cells of each row add up to the width of the title block.
    cells_to_fill_in = (
        _Cell("legal owner", "", 44.0),
        _Cell("created by", "", 40.0),
        _Cell("approved by", "", 40.0),
    )
    return (
        (_Cell("part", f"{title.name}: housing", _BLOCK.width),),
        cells_to_fill_in,
        (
            _Cell("number", f"{title.name}-01", 62.0),
            _Cell("revision", revision, 22.0),
            _Cell("mass", mass_text, 40.0),
        ),
        (
            _Cell("material", title.process.material, 62.0),
            _Cell("process", title.process.name, 62.0),
        ),
        (
            _Cell("general tolerance", title.general_tolerance, 40.0),
            _Cell("scale", scale, 18.0),
            _Cell("sheet", f"{size} 1/1", 20.0),
            _Cell("date", date_text, 26.0),
            _Cell("first angle", "", 20.0),  # `_draw_title` draws the symbol in this cell
        ),
    )


def _draw_first_angle_symbol(paper: Canvas, x: float, y: float) -> None:
    """Draw the symbol of first-angle projection, ISO 5456-2, around a point [mm on paper].

    The symbol shows a truncated cone from the side, and to its right the two circles of the cone seen from its small
    end. The cone is 5 mm long, with diameters of 2.6 and 5.2 mm. The standard does not prescribe the size of the
    symbol.
    """
    small_top, small_foot = (x - 7.0, y + 1.3), (x - 7.0, y - 1.3)
    large_top, large_foot = (x - 2.0, y + 2.6), (x - 2.0, y - 2.6)
    outline = [small_foot, small_top, large_top, large_foot, small_foot]
    for start, end in itertools.pairwise(outline):
        paper.line(start, end, "SHEET")
    paper.circle((x + 4.0, y), 1.3, "SHEET")
    paper.circle((x + 4.0, y), 2.6, "SHEET")
