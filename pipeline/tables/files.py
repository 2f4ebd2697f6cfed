"""From the bytes of a file to lines of text: encodings, workbooks and the standard input."""

import codecs
import csv
import datetime
import functools
import io
import itertools
import re
import sys
import unicodedata
import zipfile
import zlib
from collections.abc import Iterable, Iterator
from pathlib import Path

from pipeline.tables.words import FOREIGN_WORDS
from sensor.input_file import read_bytes
from sensor.quantity import InputError, validation_error

MOST_LINES = 1_000_000
LONGEST_LINE = 65536  # bytes of a line of a stream: what is longer is no line of numbers
_MOST_UNPACKED = 64 * 2**20  # bytes of a workbook
_MOST_CELLS = 2_000_000  # of a sheet, from its first cell to its last
_MOST_TEXT = 2**26  # letters of a sheet whose texts were all as long as the longest
_MARKS = {b"\xef\xbb\xbf": "utf-8-sig", b"\xff\xfe\0\0": "utf-32", b"\xff\xfe": "utf-16", b"\xfe\xff": "utf-16"}
_ANY_BYTES = ("mac_roman", "cp850")  # in which all bytes are letters: only by a word that they say
_ENCODINGS = ("cp1252", "cp1250", "cp932", "euc_jp", "gb18030", "cp949", "big5", *_ANY_BYTES)
"""That exports have beside Unicode."""
_NULS = 0.3  # of every second byte: text of 16 bits without its mark
_ANSI = re.compile(r"\x1b\[[0-9;]*[A-Za-z]")  # what colours the lines of a terminal
_NO_TEXT = re.compile("[\x00-\x08\x0e-\x1f\x7f-\x84\x86-\x9f\ufffd\ufffe\uffff]")


def place_of(source: str, line: int, label: str = "") -> str:
    """Return how an error names a place in a file."""
    return f"{source}, line {line}, column {label!r}" if label else f"{source}, line {line}"


def texts_of(source: Path | str) -> list[tuple[str, list[str]]]:
    """Return the name of each sheet and its lines, with their ends."""
    if str(source) == "-":
        return [("-", list(itertools.islice(lines_of_stream(), MOST_LINES)))]
    content = read_bytes(source, "FILE")
    if content.startswith(b"PK\x03\x04"):
        return _workbook(str(source), content)
    text = _ANSI.sub("", _decoded(content).rstrip("\x1a")).replace("\r\r\n", "\n").replace("\ufeff", "")
    if _NO_TEXT.search(text):
        hint = "export the table as CSV in UTF-8, or as XLSX"
        raise validation_error(str(source), "bytes", "", "a text file, CSV, or a workbook, XLSX", hint)
    lines = list(itertools.islice(io.StringIO(text, newline=None), MOST_LINES + 1))
    if len(lines) > MOST_LINES:
        raise validation_error(str(source), "its lines", "", f"at most {MOST_LINES}", "export fewer samples a second")
    long = next((number for number, line in enumerate(lines, start=1) if len(line) >= LONGEST_LINE), None)
    if long is not None:
        bound = f"a line of less than {LONGEST_LINE} letters"
        raise validation_error(place_of(str(source), long), lines[long - 1][:40], "", bound, "correct that line")
    return [(str(source), lines)]


def lines_of_stream() -> Iterator[str]:
    """Yield the lines of the standard input, with their ends, as they come; raises InputError for what is no text."""
    encoding = "utf-8-sig"
    number = 0
    while raw := sys.stdin.buffer.readline(LONGEST_LINE):
        number += 1
        text = _ANSI.sub("", raw.decode(encoding, "replace"))
        encoding = "utf-8"
        if _NO_TEXT.search(text) or len(raw) == LONGEST_LINE:
            raise validation_error(place_of("-", number), "bytes", "", "a line of text in UTF-8", "send CSV")
        yield text


def _decoded(content: bytes) -> str:
    """Return the text of bytes; what is none holds characters that no text has."""
    for mark, encoding in _MARKS.items():
        if content.startswith(mark):
            return content.decode(encoding, "replace")
    if b"\x1b$" in content:
        return content.decode("iso2022_jp", "replace")
    half = len(content) // 2
    for start, encoding in ((1, "utf-16-le"), (0, "utf-16-be")):
        if content[start::2].count(0) > _NULS * half:
            return content[: 2 * half].decode(encoding, "replace")
    try:
        return content.decode("utf-8")
    except UnicodeDecodeError:
        return content.decode(_former_encoding(content), "replace")


def _former_encoding(content: bytes) -> str:
    """Return the encoding before Unicode in which bytes say most words of headers, else the first that has them all."""
    letters = {}
    for encoding in _ENCODINGS:
        try:
            start = codecs.getincrementaldecoder(encoding)().decode(content[:LONGEST_LINE])
        except UnicodeDecodeError:
            continue
        text = unicodedata.normalize("NFKC", start).casefold()
        letters[encoding] = sum(len(word) for word in FOREIGN_WORDS if word in text)
    best = max(letters, key=letters.__getitem__)
    return best if letters[best] or best not in _ANY_BYTES else "cp1252"


def _workbook(source: str, content: bytes) -> list[tuple[str, list[str]]]:
    """Return the name and the lines of each visible sheet of a workbook; raises InputError for what is none."""
    import python_calamine

    sheets = []
    try:
        book = python_calamine.CalamineWorkbook.from_filelike(io.BytesIO(_unpacked(source, content)))
        for about in book.sheets_metadata:
            if (
                about.visible == python_calamine.SheetVisibleEnum.Visible
                and about.typ == python_calamine.SheetTypeEnum.WorkSheet
            ):
                rows = book.get_sheet_by_name(about.name).to_python(skip_empty_area=False)
                sheets.append((about.name, [tabbed(map(_cell_text, row)) for row in rows]))
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
    filled = [(name, lines) for name, lines in sheets if any(line.strip() for line in lines)]
    return (
        [(f"{source}, sheet {name!r}", lines) for name, lines in filled]
        if len(filled) > 1
        else [(source, lines) for _, lines in filled]
    )


def _unpacked(source: str, content: bytes) -> bytes:
    """Return a workbook that is not packed any more; raises InputError where reading it would take too much memory."""
    unpacked = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(content)) as packed, zipfile.ZipFile(unpacked, "w") as stored:
        members = packed.infolist()
        size = sum(member.file_size for member in members)
        if "xl/workbook.xml" not in packed.namelist() or size > _MOST_UNPACKED:
            bound = f"a workbook, XLSX, of at most {_MOST_UNPACKED // 2**20} MiB unpacked"
            raise validation_error(source, size, "bytes", bound, "save the table as CSV in UTF-8")
        # The reader fills a whole rectangle for each sheet, and copies a shared text into every cell that has it.
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


def _cell_text(cell: object) -> object:
    """Return a cell of a workbook as a text of the same number, or of the time of day."""
    if isinstance(cell, datetime.timedelta):
        seconds = cell.total_seconds()
        return f"{seconds // 3600:.0f}:{seconds % 3600 // 60:02.0f}:{seconds % 60:09.6f}"
    if isinstance(cell, datetime.datetime | datetime.time):
        return cell.isoformat()
    return int(cell) if isinstance(cell, float) and cell.is_integer() and abs(cell) < 2**53 else cell


def tabbed(cells: Iterable[object]) -> str:
    """Return a line of cells with tabs between."""
    text = io.StringIO()
    csv.writer(text, delimiter="\t", lineterminator="").writerow([re.sub(r"\s", " ", str(cell)) for cell in cells])
    return text.getvalue()
