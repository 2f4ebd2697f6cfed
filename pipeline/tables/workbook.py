"""The cells of a workbook as texts."""

import datetime
import functools
import io
import re
import zipfile
import zlib

import python_calamine

from pipeline.tables.decoding import MOST_LINES
from sensor.quantity import InputError, validation_error

_MOST_UNPACKED = 64 * 2**20  # largest unpacked workbook [bytes]
_MOST_CELLS = 2_000_000  # most cells of a sheet, from its first cell to its last
_MOST_TEXT = 2**26  # most characters of a sheet, if all texts had the length of the longest


def cells_of_workbook(source: str, content: bytes) -> list[tuple[str, list[list[str]]]]:
    """Return the name of each visible sheet that is not empty, and the texts of its cells by rows.

    Raises InputError for bytes that are no workbook.
    """
    sheets = []
    try:
        book = python_calamine.CalamineWorkbook.from_filelike(io.BytesIO(_unpacked(source, content)))
        for about in book.sheets_metadata:
            if (
                about.visible == python_calamine.SheetVisibleEnum.Visible
                and about.typ == python_calamine.SheetTypeEnum.WorkSheet
            ):
                rows = book.get_sheet_by_name(about.name).to_python(skip_empty_area=False)
                sheets.append((about.name, [list(map(_cell_text, row)) for row in rows]))
    except (
        python_calamine.CalamineError,
        zipfile.BadZipFile,
        zlib.error,
        OSError,
        ValueError,
        RuntimeError,
        EOFError,
    ) as error:
        if isinstance(error, InputError):
            raise
        bound = f"a workbook, XLSX, that can be read ({error!r:.100})"
        raise validation_error(source, "bytes", "", bound, "save it as CSV in UTF-8") from error
    filled = [(name, rows) for name, rows in sheets if any(map(any, rows))]
    if len(filled) == 1:
        return [(source, filled[0][1])]
    return [(f"{source}, sheet {name!r}", rows) for name, rows in filled]


def _unpacked(source: str, content: bytes) -> bytes:
    """Return an unpacked workbook; raises InputError if reading it would need too much memory."""
    unpacked = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(content)) as packed, zipfile.ZipFile(unpacked, "w") as stored:
        members = packed.infolist()
        size = sum(member.file_size for member in members)
        if "xl/workbook.xml" not in packed.namelist() or size > _MOST_UNPACKED:
            bound = f"a workbook, XLSX, of at most {_MOST_UNPACKED // 2**20} MiB unpacked"
            raise validation_error(source, size, "bytes", bound, "save the table as CSV in UTF-8")
        # The reader fills a complete rectangle for each sheet, and copies a shared text into each of its cells.
        texts = cells = 0
        longest = 0
        for member in members:
            part = packed.read(member)
            if part.count(b"row") > 2 * MOST_LINES:
                raise validation_error(source, part.count(b"row"), "rows", f"at most {MOST_LINES}", "export fewer")
            rows = re.split(rb"<(?:\w+:)?row\b", part)
            columns = [_column_number(match[1]) for match in re.finditer(rb"\br=[\"']([A-Z]{1,3})[0-9]", part)]
            lines = [int(match[1]) for match in re.finditer(rb"\br=[\"'][A-Z]{0,3}([0-9]{1,9})[\"']", part)]
            wide = max([*columns, *(len(re.findall(rb"<(?:\w+:)?c\b", row)) for row in rows[1:])], default=0)
            cells = max(cells, wide * max([*lines, len(rows) - 1]))
            texts += len(re.findall(rb"\bt=[\"']s[\"']", part))
            longest = max([longest, *(len(text) for text in re.split(rb"<(?:\w+:)?si\b", part)[1:])])
            stored.writestr(member.filename, part)
        if cells > _MOST_CELLS or texts * longest > _MOST_TEXT:
            bound = f"a workbook whose sheets have at most {_MOST_CELLS} cells, and no huge texts"
            raise validation_error(source, cells, "cells", bound, "save the table as CSV in UTF-8")
    return unpacked.getvalue()


def _column_number(letters: bytes) -> int:
    return functools.reduce(lambda number, letter: 26 * number + letter - 64, letters, 0)


def _cell_text(cell: object) -> str:
    """Return a cell of a workbook as text of the same number or time of day."""
    if isinstance(cell, datetime.timedelta):
        seconds = cell.total_seconds()
        return f"{seconds // 3600:.0f}:{seconds % 3600 // 60:02.0f}:{seconds % 60:09.6f}"
    if isinstance(cell, datetime.datetime | datetime.time):
        return cell.isoformat()
    if isinstance(cell, float) and cell.is_integer() and abs(cell) < 2**53:
        return str(int(cell))
    return re.sub(r"\s", " ", str(cell)).strip()
