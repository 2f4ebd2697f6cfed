"""Decode the bytes of a file or of the standard input to lines of text, in any common encoding."""

import io
import itertools
import re
import sys
import unicodedata
from collections.abc import Iterator

from pipeline.tables.header_words import FOREIGN_WORDS
from sensor.quantity import validation_error

MAX_LINES = 1_000_000  # maximum number of lines of a file, which limits the time and memory for it
LONGEST_LINE = 65536  # maximum length of a line [bytes]; a longer line is not a row of a table
SHOWN_CELL = 40  # length to which a line or a cell is truncated in messages [characters]
# Byte order marks and the encodings that they announce. The mark of UTF-32 begins with a mark of UTF-16, so the mark of
# UTF-32 is tested first.
_MARKS = {b"\xef\xbb\xbf": "utf-8-sig", b"\xff\xfe\0\0": "utf-32", b"\xff\xfe": "utf-16", b"\xfe\xff": "utf-16"}
_LEGACY = ("cp1252", "cp1250", "cp932", "euc_jp", "gb18030", "cp949", "big5")  # legacy encodings of exported tables
# Legacy encodings in which every byte is valid, so they are accepted only if a known word is found in the text
_ALWAYS_VALID = ("mac_roman", "cp850")
_NULL_FRACTION = 0.3  # fraction of null bytes among every second byte above which a text is taken for UTF-16
_ANSI = re.compile(r"\x1b\[[0-9;]*[A-Za-z]")  # escape sequences for the colours of a terminal
_NO_TEXT = re.compile("[\x00-\x08\x0e-\x1f\x7f-\x84\x86-\x9f\ufffd\ufffe\uffff]")  # characters that text never contains


def place_of(source: str, line: int, label: str = "") -> str:
    """Return the name of a line or of a cell in a file for error messages."""
    return f"{source}, line {line}, column {label!r}" if label else f"{source}, line {line}"


def lines_of_text(source: str, content: bytes) -> list[str]:
    """Return the lines of a text file with their line ends.

    `source` is the name of the file in error messages. Raises InputError if the bytes are not text, if there are too
    many lines, and if a line is too long.
    """
    text = _decode_text(content).rstrip("\x1a")  # the end-of-file character of DOS
    # Remove terminal colours, doubled carriage returns, and byte order marks.
    text = _ANSI.sub("", text).replace("\r\r\n", "\n").replace("\ufeff", "")
    if _NO_TEXT.search(text):
        hint = "export the table as CSV in UTF-8, or as XLSX"
        raise validation_error(source, "bytes", "", "a text file, CSV, or a workbook, XLSX", hint)
    # One line more than allowed is read, which is enough to notice that there are too many.
    lines = list(itertools.islice(io.StringIO(text, newline=None), MAX_LINES + 1))
    if len(lines) > MAX_LINES:
        raise validation_error(source, "its lines", "", f"at most {MAX_LINES}", "export fewer samples per second")
    for number, line in enumerate(lines, start=1):
        if len(line) >= LONGEST_LINE:
            bound = f"a line of fewer than {LONGEST_LINE} characters"
            raise validation_error(place_of(source, number), line[:SHOWN_CELL], "", bound, "correct that line")
    return lines


def lines_of_stream() -> Iterator[str]:
    """Yield the lines of the standard input with their line ends, as they arrive.

    Raises InputError for a line that is not UTF-8 text or is too long.
    """
    number = 0
    while raw := sys.stdin.buffer.readline(LONGEST_LINE):
        number += 1
        encoding = "utf-8-sig" if number == 1 else "utf-8"  # only the first line may begin with a byte order mark
        text = _ANSI.sub("", raw.decode(encoding, "replace"))
        is_cut_off = len(raw) == LONGEST_LINE
        if _NO_TEXT.search(text) or is_cut_off:
            raise validation_error(place_of("-", number), "bytes", "", "a line of text in UTF-8", "send CSV")
        yield text


def _decode_text(content: bytes) -> str:
    """Return the text of a file whose encoding is unknown.

    Byte order marks, escape sequences and null bytes show some encodings. For other files, UTF-8 is tried first and
    then the legacy encodings, because text in a legacy encoding is rarely valid UTF-8. Bytes that are not text become
    characters of `_NO_TEXT`.
    """
    for mark, encoding in _MARKS.items():
        if content.startswith(mark):
            return content.decode(encoding, "replace")
    if b"\x1b$" in content:  # the escape sequence that begins Japanese characters
        return content.decode("iso2022_jp", "replace")
    # In UTF-16, every second byte of Latin text is null: the bytes with odd indices in utf-16-le, and the bytes with
    # even indices in utf-16-be.
    half = len(content) // 2
    for start, encoding in ((1, "utf-16-le"), (0, "utf-16-be")):
        if content[start::2].count(0) > _NULL_FRACTION * half:
            return content[: 2 * half].decode(encoding, "replace")
    try:
        return content.decode("utf-8")
    except UnicodeDecodeError:
        return _decode_legacy_text(content)


def _decode_legacy_text(content: bytes) -> str:
    """Return the text of a file in the legacy encoding in which it contains the most known header words.

    The words are compared by their total length, because a short word may occur by chance. If no word is found, the
    text is in the first legacy encoding that decodes the bytes without an error.
    """
    best_text = content.decode("cp1252", "replace")  # only used if no encoding decodes the bytes without an error
    most_letters = -1  # less than 0, so that even a text without known words is better than this first one
    for encoding in (*_LEGACY, *_ALWAYS_VALID):
        try:
            text = content.decode(encoding)
        except UnicodeDecodeError:
            continue
        head = unicodedata.normalize("NFKC", text[:LONGEST_LINE]).casefold()
        letters = sum(len(word) for word in FOREIGN_WORDS if word in head)
        if letters > most_letters and (letters or encoding in _LEGACY):
            best_text, most_letters = text, letters
    return best_text
