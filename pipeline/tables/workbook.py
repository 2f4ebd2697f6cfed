"""Read the cells of a workbook as text."""

import datetime
import functools
import io
import re
import zipfile
import zlib
from collections.abc import Iterable, Iterator

import python_calamine

from pipeline.tables.decoding import MAX_LINES
from sensor.quantity import InputError, validation_error

_MAX_UNPACKED = 64 * 2**20  # maximum size of an unpacked workbook [bytes]
_MAX_CELLS = 2_000_000  # maximum number of cells in the rectangle that encloses all cells of a sheet
_MAX_TEXT = 2**26  # maximum number of text cells times the length of the longest text [characters]


# A damaged workbook may raise any of these exceptions.
_READING_ERRORS = (
    python_calamine.CalamineError,
    zipfile.BadZipFile,
    zlib.error,
    OSError,
    ValueError,
    RuntimeError,
    EOFError,
)


def cells_of_workbook(source: str, content: bytes) -> list[tuple[str, list[list[str]]]]:
    """Return the visible sheets of a workbook that are not empty, each with its name and its rows of cells as text.

    The name is `source`, the name of the file; if there are several sheets, the name of the sheet follows. Raises
    InputError if the bytes are not a workbook, or if the workbook is too large.
    """
    try:
        sheets = _visible_sheets(_unpack(source, content))
    except InputError:  # it is a ValueError, but it has its own message
        raise
    except _READING_ERRORS as error:
        bound = f"a workbook, XLSX, that can be read ({error!r:.100})"
        raise validation_error(source, "bytes", "", bound, "save it as CSV in UTF-8") from error
    filled_sheets = [(name, rows) for name, rows in sheets if any(cell for row in rows for cell in row)]
    if len(filled_sheets) == 1:
        return [(source, filled_sheets[0][1])]
    return [(f"{source}, sheet {name!r}", rows) for name, rows in filled_sheets]


def _visible_sheets(content: bytes) -> list[tuple[str, list[list[str]]]]:
    """Return the name and the rows of cells of each visible worksheet in the bytes of a workbook.

    Empty rows are kept, because messages state the number of a row.
    """
    sheets = []
    book = python_calamine.CalamineWorkbook.from_filelike(io.BytesIO(content))
    for sheet in book.sheets_metadata:
        is_visible = sheet.visible == python_calamine.SheetVisibleEnum.Visible
        if is_visible and sheet.typ == python_calamine.SheetTypeEnum.WorkSheet:  # other types are, for example, charts
            rows = book.get_sheet_by_name(sheet.name).to_python(skip_empty_area=False)
            sheets.append((sheet.name, [list(map(_cell_text, row)) for row in rows]))
    return sheets


def _unpack(source: str, content: bytes) -> bytes:
    """Return an uncompressed copy of a workbook, after a check of its size.

    Raises InputError if the bytes are not a workbook, or if the library that reads it would need too much memory.
    """
    unpacked = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(content)) as packed, zipfile.ZipFile(unpacked, "w") as stored:
        members = packed.infolist()
        size = sum(member.file_size for member in members)
        if "xl/workbook.xml" not in packed.namelist() or size > _MAX_UNPACKED:
            bound = f"a workbook, XLSX, of at most {_MAX_UNPACKED // 2**20} MiB unpacked"
            raise validation_error(source, size, "bytes", bound, "save the table as CSV in UTF-8")

        def unpacked_parts() -> Iterator[bytes]:
            """Yield the XML text of each member, and store it uncompressed."""
            for member in members:
                part = packed.read(member)
                yield part  # it is checked before it is stored
                stored.writestr(member.filename, part)

        _check_memory(source, unpacked_parts())
    return unpacked.getvalue()


def _check_memory(source: str, parts: Iterable[bytes]) -> None:
    """Raise InputError if the library that reads a workbook would need too much memory.

    `parts` are the XML texts of the workbook. The library allocates the whole rectangle that encloses the cells of a
    sheet, and copies a shared text into each cell that uses it. Both sizes are estimated from the XML texts, without
    parsing them. All `parts` are read.
    """
    max_cells = 0  # number of cells of the largest sheet
    cells_with_shared_text = 0
    longest_text = 0  # length of the longest shared text, with its tags [bytes]
    for part in parts:
        if part.count(b"row") > 2 * MAX_LINES:  # a row has an opening and a closing tag
            raise validation_error(source, part.count(b"row"), "rows", f"at most {MAX_LINES}", "export fewer")
        max_cells = max(max_cells, _enclosing_cells(part))
        cells_with_shared_text += len(re.findall(rb"\bt=[\"']s[\"']", part))  # their type is t="s"
        # Each shared text begins with the tag <si>. The first item of the split is the XML before the first text.
        texts = re.split(rb"<(?:\w+:)?si\b", part)[1:]
        longest_text = max([longest_text, *map(len, texts)])
    if max_cells > _MAX_CELLS or cells_with_shared_text * longest_text > _MAX_TEXT:
        bound = f"a workbook whose sheets have at most {_MAX_CELLS} cells, and no huge texts"
        raise validation_error(source, max_cells, "cells", bound, "save the table as CSV in UTF-8")


def _enclosing_cells(part: bytes) -> int:
    """Return the number of cells in the rectangle that encloses all cells of a sheet, whose XML text is `part`.

    The result is 0 for a part of the workbook without cells.
    """
    rows = re.split(rb"<(?:\w+:)?row\b", part)
    # A cell may state its position, as in r="C5". A cell without a stated position follows the previous cell.
    columns = [_column_number(match[1]) for match in re.finditer(rb"\br=[\"']([A-Z]{1,3})[0-9]", part)]
    lines = [int(match[1]) for match in re.finditer(rb"\br=[\"'][A-Z]{0,3}([0-9]{1,9})[\"']", part)]
    width = max([*columns, *(len(re.findall(rb"<(?:\w+:)?c\b", row)) for row in rows[1:])], default=0)
    return width * max([*lines, len(rows) - 1])


def _column_number(letters: bytes) -> int:
    """Return the number of a column from its letters, counted from 1: A is 1, and AA is 27."""
    return functools.reduce(lambda number, letter: 26 * number + letter - 64, letters, 0)  # the code of A is 65


def _cell_text(cell: object) -> str:
    """Return the value of a cell as text: a number with all digits, a time of day in ISO format, or the text itself."""
    if isinstance(cell, datetime.timedelta):
        seconds = cell.total_seconds()
        return f"{seconds // 3600:.0f}:{seconds % 3600 // 60:02.0f}:{seconds % 60:09.6f}"
    if isinstance(cell, datetime.datetime | datetime.time):
        return cell.isoformat()
    if isinstance(cell, float) and cell.is_integer() and abs(cell) < 2**53:  # all smaller integers are exact floats
        return str(int(cell))
    return re.sub(r"\s", " ", str(cell)).strip()
