"""From the bytes of a table to rows of cells: encodings, workbooks, what parts cells, how numbers are written."""

import codecs
import csv
import datetime
import functools
import io
import itertools
import re
import sys
import tomllib
import unicodedata
import zipfile
import zlib
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

from sensor.input_file import read_bytes
from sensor.quantity import InputError, validation_error

WORDS = tomllib.loads(Path(__file__).with_name("table_words.toml").read_text(encoding="utf-8"))
"""The words of headers and units: table_words.toml."""
_FOREIGN_WORDS = {
    unicodedata.normalize("NFKC", word).casefold()
    for words in (*WORDS["words"].values(), *WORDS["units"].values())
    for word in words
    if not word.isascii()
}

MOST_LINES = 1_000_000
_LONGEST_LINE = 65536  # bytes of a line of a stream: what is longer is no line of numbers
_LONGEST_NUMBER = 64
_MOST_UNPACKED = 64 * 2**20  # bytes of a workbook
_MOST_CELLS = 2_000_000  # of a sheet, from its first cell to its last
_MOST_TEXT = 2**26  # letters of a sheet whose texts were all as long as the longest
_MOST_JOINED = 5  # lines of a row with a quoted cell
_SAMPLE = 400  # lines that show what parts cells
_MARKS = {b"\xef\xbb\xbf": "utf-8-sig", b"\xff\xfe\0\0": "utf-32", b"\xff\xfe": "utf-16", b"\xfe\xff": "utf-16"}
_ENCODINGS = ("cp932", "euc_jp", "gb18030", "cp949", "big5", "cp1252", "cp1250")  # that exports have beside Unicode
_ANY_BYTES = ("mac_roman", "cp850")  # in which all bytes are letters: only by a word that they say
_NULS = 0.3  # of every second byte: text of 16 bits without its mark
_SPACES = re.compile(r"(?<![ \u3000])[ \u3000]++(?![(\[{<])")  # no unit in brackets is parted from its word
_WIDE_SPACES = re.compile(r"[ \u3000]{2,}")
_CLOCK_BEFORE = re.compile(r"\s*((?:\d{4}-\d\d-\d\d[ T])?\d{1,2}:\d\d:\d\d(?:[.,]\d{1,9})?)\s*(?:->|→)\s?")
_DIGIT = re.compile("[0-9]")
_MARKED = ('"', "'", ">", "\u2192")  # what quoted cells and clocks have
_COMMENT = re.compile(r"\s*(#|%|//)\s*")
_GROUPED_BY_SPACE = re.compile(r"([+-]?[0-9]{1,3})((?:[ '\u2019\u00a0\u202f\u2009][0-9]{3})+)(?![0-9])")
_ANSI = re.compile(r"\x1b\[[0-9;]*[A-Za-z]")  # what colours the lines of a terminal
_NO_TEXT = re.compile("[\x00-\x08\x0e-\x1f\x7f-\x84\x86-\x9f\ufffd\ufffe\uffff]")
_NUMBER = re.compile(
    r"[+-]?(?P<digits>[0-9.,]*[0-9][0-9.,]*)(?P<exponent>[eEdD][+-]?[0-9]{1,4})?(?: ?(?P<unit>[^\W\d_]{1,4}))?"
)
_GROUPS = re.compile(r"[1-9][0-9]{0,2}([.,])[0-9]{3}(?:\1[0-9]{3})*")
_MISSING = frozenset(
    ("", "-", "--", "---", "nan", "na", "n/a", "#n/a", "#na", "null", "none", "#value!", "inf", "-inf")
)


class TableRow(NamedTuple):
    """One line of a file: its number, from 1, and its cells without spaces around them.

    `clock` is the time of day that a serial monitor writes before it, `fault` why its cells cannot be told.
    """

    line: int
    cells: tuple[str, ...]
    clock: str = ""
    fault: str = ""

    @property
    def empty(self) -> bool:
        """Say whether no cell holds anything."""
        return not any(self.cells)


class WrittenNumber(NamedTuple):
    """A cell that is a number: its text without spaces, the decimal sign and the sign between thousands, "" for none.

    It is `unclear` where the one sign in it may be either, as in 1,500. `unit` is what stands behind it.
    """

    text: str
    decimal: str
    grouping: str
    unclear: bool = False
    unit: str = ""

    def plain(self, decimal: str) -> str:
        """Return the number as Python writes it, where a sign is the decimal one."""
        grouping = "," if decimal == "." else "."
        return self.text.replace(grouping, "").replace(decimal, ".").replace("D", "e").replace("d", "e")


@functools.lru_cache(maxsize=4096)
def as_number(cell: str) -> WrittenNumber | None:
    """Return how a cell is written as a number, in digits 0 to 9; None for other text."""
    if not cell or len(cell) > _LONGEST_NUMBER or not _DIGIT.search(cell):
        return None
    text = cell.replace("\u2212", "-").replace("\u00b5", "u").replace("\u03bc", "u")
    grouped = _GROUPED_BY_SPACE.match(text)
    if grouped:
        text = grouped[1] + re.sub(r"[^0-9]", "", grouped[2]) + text[grouped.end() :]
    match = _NUMBER.fullmatch(text)
    if match is None or (match["unit"] and match["unit"] not in WORDS["units"]):
        return None
    unit = match["unit"] or ""
    text = text[: match.start("unit")].strip() if unit else text
    digits = match["digits"]
    signs = [letter for letter in digits if letter in ".,"]
    if not signs:
        return WrittenNumber(text, "", "", unit=unit)
    if len(signs) == 1:
        unclear = not match["exponent"] and not grouped and _GROUPS.fullmatch(digits) is not None
        return WrittenNumber(text, "" if unclear else signs[0], "", unclear, unit)
    # Of several signs the first ones part thousands; the last is the decimal one if it is another.
    *groups, last = signs
    grouping = signs[0]
    whole = digits if last == grouping else digits[: digits.rindex(last)]
    if set(groups) != {grouping} or not _GROUPS.fullmatch(whole):
        return None
    return WrittenNumber(text, "," if grouping == "." else ".", grouping, unit=unit)


def is_number(cell: str) -> bool:
    """Say whether a cell is written as a number, with a decimal point or comma, in digits 0 to 9."""
    return as_number(cell) is not None


def is_missing(cell: str) -> bool:
    """Say whether a cell is empty, or says in a common way that it holds no number."""
    return cell.lower() in _MISSING


def place_of(source: str, line: int, label: str = "") -> str:
    """Return how an error names a place in a file."""
    return f"{source}, line {line}, column {label!r}" if label else f"{source}, line {line}"


def row_of(delimiter: str, line: int, text: str) -> TableRow:
    """Return the cells of a line; a quote that stays open and a huge cell are its fault."""
    if delimiter.strip(" ") and not any(mark in text for mark in _MARKED):  # as most are
        return TableRow(line, tuple(map(str.strip, text.split(delimiter))))
    clock, rest = _without_clock(text)
    fault = ""
    try:
        cells = _cells(rest, delimiter)
    except csv.Error as error:
        cells = [rest]
        fault = str(error)
    return TableRow(line, tuple(_bare(cell) for cell in cells), clock, fault)


def _without_clock(text: str) -> tuple[str, str]:
    """Return the time of day that a serial monitor writes before a line, and the line."""
    clock = _CLOCK_BEFORE.match(text)
    return (clock[1], text[clock.end() :]) if clock else ("", text)


def _bare(cell: str) -> str:
    """Return a cell without spaces, single quotes and a spreadsheet's ="" around it."""
    bare = cell.strip()
    if bare.startswith('="') and bare.endswith('"'):
        return bare[2:-1].strip()
    return bare.strip("'").strip() if bare.startswith("'") else bare


def _cells(text: str, delimiter: str) -> list[str]:
    if delimiter == " ":
        return _SPACES.split(text.strip())
    if delimiter == "  ":
        return _WIDE_SPACES.split(text.strip())
    return next(csv.reader([text], delimiter=delimiter, strict=True, skipinitialspace=True), [])


def refuse_fault(source: str, row: TableRow) -> None:
    """Raise InputError for a row whose cells cannot be told."""
    if row.fault:
        name = place_of(source, row.line)
        raise validation_error(name, row.cells[0][:40], "", f"cells of a table ({row.fault})", "correct that line")


def delimiter_of(lines: Sequence[str]) -> str:
    """Return what parts the cells: that by which most of them are numbers, else the first that half the lines have."""
    filled = [line for line in lines if line.strip()]
    filled = [_without_clock(line[:_LONGEST_LINE])[1] for line in filled[:: max(1, len(filled) // _SAMPLE)]]
    candidates = ("\t", ";", "|", ",", "  ", " ")
    best = ""
    most = (1, 0)  # a single number has nothing beside it
    for delimiter in candidates:
        cells = [cell for line in filled if delimiter in line for cell in row_of(delimiter, 0, line).cells]
        numbers = sum(map(is_number, cells))
        if (numbers, numbers - len(cells)) > most:
            best, most = delimiter, (numbers, numbers - len(cells))
    if best:
        return best
    for delimiter in candidates:
        if 2 * sum(delimiter in line for line in filled) >= max(1, len(filled)):
            return delimiter
    return ","


def sheets_of(source: Path | str) -> list[tuple[str, str, list[TableRow]]]:
    """Return name, delimiter and rows of each sheet of a file that holds anything; a text is one sheet.

    Raises InputError for what is no table.
    """
    sheets = []
    for name, lines in _texts_of(source):
        delimiter = delimiter_of(lines)
        rows = _rows(delimiter, lines)
        if not all(row.empty for row in rows):
            sheets.append((name, delimiter, rows))
    if not sheets:
        bound = "a CSV file with a header and numbers, not an empty one"
        raise validation_error(str(source), "", "", bound, "export the table again")
    return sheets


def _texts_of(source: Path | str) -> list[tuple[str, list[str]]]:
    """Return the name and the lines of each sheet."""
    if str(source) == "-":
        return [("-", list(itertools.islice(lines_of_stream(), MOST_LINES)))]
    content = read_bytes(source, "FILE")
    if content.startswith(b"PK\x03\x04"):
        return _workbook(str(source), content)
    text = _ANSI.sub("", _decoded(content).rstrip("\x1a")).replace("\r\r\n", "\n").replace("\ufeff", "")
    if _NO_TEXT.search(text):
        hint = "export the table as CSV in UTF-8, or as XLSX"
        raise validation_error(str(source), "bytes", "", "a text file, CSV, or a workbook, XLSX", hint)
    lines = [line.rstrip("\n") for line in itertools.islice(io.StringIO(text, newline=None), MOST_LINES + 1)]
    if len(lines) > MOST_LINES:
        raise validation_error(str(source), "its lines", "", f"at most {MOST_LINES}", "export fewer samples a second")
    long = next((number for number, line in enumerate(lines, start=1) if len(line) >= _LONGEST_LINE), None)
    if long is not None:
        bound = f"a line of less than {_LONGEST_LINE} letters"
        raise validation_error(place_of(str(source), long), lines[long - 1][:40], "", bound, "correct that line")
    return [(str(source), lines)]


def _rows(delimiter: str, lines: Sequence[str]) -> list[TableRow]:
    """Return the rows of lines; without the empty ones where every other line is empty.

    A commented line with numbers is left out, as data that somebody took out. One without may be the header.
    """
    rows: list[TableRow] = []
    index = 0
    while index < len(lines):
        row, count = _row_at(delimiter, lines, index)
        if not _COMMENT.match(lines[index]) or not any(map(is_number, row.cells)):
            rows.append(row)
        index += count
    rows = list(_without_labels(rows))
    is_double_spaced = all(one.empty or other.empty for one, other in itertools.pairwise(rows))
    return [row for row in rows if not row.empty] if is_double_spaced else rows


def _row_at(delimiter: str, lines: Sequence[str], index: int) -> tuple[TableRow, int]:
    """Return the row that begins at an index of lines, and the number of lines it takes: a quoted cell may go on."""
    text = lines[index]
    number = index + 1
    comment = _COMMENT.match(text)
    row = row_of(delimiter, number, text[comment.end() :] if comment else text)
    if row.fault and text.count('"') % 2 == 1:
        for count in range(2, min(_MOST_JOINED, len(lines) - index) + 1):
            joined = row_of(delimiter, number, " ".join(lines[index : index + count]))
            if not joined.fault:
                return joined, count
    return row, 1


def _without_labels(rows: Iterable[TableRow]) -> Iterator[TableRow]:
    """Yield rows; where each cell says what it is, as in `force_N:1.2,travel_mm:3.4`, below a header of that."""
    header: tuple[str, ...] = ()
    for row in rows:
        is_labelled = len(row.cells) > 1 and ":" in row.cells[0]
        parts = [cell.rpartition(":") for cell in row.cells] if is_labelled else []
        if parts and all(label and is_number(value.strip()) and not label.isdecimal() for label, _, value in parts):
            if header != (header := tuple(label.strip() for label, _, _ in parts)):
                yield TableRow(row.line, header)
            yield row._replace(cells=tuple(value.strip() for _, _, value in parts))
        else:
            yield row


def single_sheet(source: Path | str) -> tuple[str, str, list[TableRow]]:
    """Return name, delimiter and rows of the one sheet that holds numbers; raises InputError as `sheets_of`."""
    sheets = sheets_of(source)
    with_numbers = [sheet for sheet in sheets if any(is_number(cell) for row in sheet[2] for cell in row.cells)]
    if len(with_numbers) > 1:
        name = ", ".join(name for name, _, _ in with_numbers)
        raise validation_error(name, len(with_numbers), "sheets", "the only sheet with numbers", "save it alone")
    return (with_numbers or sheets)[0]


def decimal_sign(source: str, columns: Iterable[Sequence[tuple[int, str]]]) -> str:
    """Return the decimal sign of the columns of a table, each a sequence of lines and cells.

    Raises InputError where numbers have two decimal signs, and where a sign may part thousands as well.
    """
    written = [[(line, number) for line, cell in cells if (number := as_number(cell))] for cells in columns]
    numbers = list(itertools.chain.from_iterable(written))
    of_commas = [(line, number) for line, number in numbers if number.decimal == ","]
    has_points = any(number.decimal == "." for _, number in numbers)
    odd = of_commas[:1] if has_points else []
    sign = "," if of_commas else "."
    is_sure = has_points or bool(of_commas)
    for column in written:
        unclear = [(line, number) for line, number in column if _may_be_thousands(number, sign)]
        if unclear and not (is_sure and _parts_thousands(column)):
            odd += unclear
    if odd:
        line, number = min(odd, key=lambda place: place[0])
        bound = "a number whose comma or point is surely decimal: commas may part thousands here"
        raise validation_error(place_of(source, line), number.text, "", bound, "export it with decimal points")
    return sign


def _may_be_thousands(number: WrittenNumber, sign: str) -> bool:
    """Say whether the one sign in a number may part its thousands, where `sign` is the decimal one of its table.

    In a table without decimal commas 1,500 may be 1500, while 1.500 is 1.5: points are decimal in most files.
    """
    return number.unclear and sign not in number.text


def _parts_thousands(column: Sequence[tuple[int, WrittenNumber]]) -> bool:
    """Say whether a column shows that it parts thousands: it has decimals, and parts each large number."""
    numbers = [number for _, number in column]
    is_parted = all(number.grouping or number.unclear or len(_whole(number)) <= 3 for number in numbers)  # noqa: PLR2004
    return is_parted and any(number.decimal for number in numbers)


def _whole(number: WrittenNumber) -> str:
    return re.split(r"[.,eEdD]", number.text.lstrip("+-"))[0]


def lines_of(source: Path | str) -> Iterator[str]:
    """Yield the lines of a regular file, or of the standard input for `-` as they come; raises InputError.

    Those of a file are parted by tabs and have decimal points.
    """
    if str(source) == "-":
        yield from lines_of_stream()
        return
    name, _, rows = single_sheet(source)
    columns: dict[int, list[tuple[int, str]]] = {}
    for row in rows:
        for index, cell in enumerate(row.cells):
            columns.setdefault(index, []).append((row.line, cell))
    try:
        sign = decimal_sign(name, columns.values())
    except InputError:  # the column may be one that nobody reads; a reader refuses the cell itself
        sign = ""  # leaves numbers as they are written
    line = 1
    for row in rows:
        yield from itertools.repeat("", row.line - line)  # so that errors name the lines of the file
        line = row.line + 1
        clock = f"{row.clock} -> " if row.clock else ""
        # a row whose cells cannot be told goes on as it is, to be refused by its reader
        yield clock + (row.cells[0] if row.fault else tabbed(_with_points(row.cells, sign)))


def _with_points(cells: Sequence[str], sign: str) -> list[str]:
    return [number.plain(sign) if sign and (number := as_number(cell)) else cell for cell in cells]


def tabbed(cells: Iterable[object]) -> str:
    """Return a line of cells with tabs between."""
    text = io.StringIO()
    csv.writer(text, delimiter="\t", lineterminator="").writerow([re.sub(r"\s", " ", str(cell)) for cell in cells])
    return text.getvalue()


def lines_of_stream() -> Iterator[str]:
    """Yield the lines of the standard input as they come; raises InputError for what is no text."""
    encoding = "utf-8-sig"
    number = 0
    while raw := sys.stdin.buffer.readline(_LONGEST_LINE):
        number += 1
        text = _ANSI.sub("", raw.decode(encoding, "replace"))
        encoding = "utf-8"
        if _NO_TEXT.search(text) or len(raw) == _LONGEST_LINE:
            raise validation_error(place_of("-", number), "bytes", "", "a line of text in UTF-8", "send CSV")
        yield text.rstrip("\r\n")


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
    """Return the encoding before Unicode in which bytes say most words of headers, else the likely one."""
    import charset_normalizer

    letters = {}
    for encoding in (*_ENCODINGS, *_ANY_BYTES):
        try:
            start = codecs.getincrementaldecoder(encoding)().decode(content[:_LONGEST_LINE])
        except UnicodeDecodeError:
            continue
        text = unicodedata.normalize("NFKC", start).casefold()
        letters[encoding] = sum(len(word) for word in _FOREIGN_WORDS if word in text)
    if any(letters.values()):
        return max(letters, key=letters.__getitem__)
    possible = [encoding for encoding in letters if encoding not in _ANY_BYTES]
    best = charset_normalizer.from_bytes(content[:_LONGEST_LINE], cp_isolation=possible).best() if possible else None
    return best.encoding if best else "cp1252"


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
