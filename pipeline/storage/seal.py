"""A seal tells a file as it was written from one that a person changed or made: the sha256 of its own content.

A JSON object carries it as its key `digest`, a text as a comment in its last line, written as `**` in a deck of
CalculiX and as `#` in TOML, a picture as a PNG text chunk.
"""

import hashlib
import json
import re
import stat
import struct
import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

KEY = "digest"
_COMMENT = "<!-- sha256 of the text above: {} -->\n"
_LAST_LINE = re.compile(re.escape(_COMMENT).replace(r"\{\}", "[0-9a-f]{64}"))
_COMMENTS = {".inp": "** sha256 of the text above: {}\n", ".toml": "# sha256 of the text above: {}\n"}
_PNG_HEAD = 33  # signature and IHDR, after which a text chunk may stand
_PNG_KEYWORD = b"twintip sha256\0"


def file_digest(path: Path) -> str:
    """Return the sha256 of a file; raises OSError."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def is_regular(path: Path) -> bool:
    """Say whether a path is a file itself: no link, no folder, no pipe, nothing."""
    try:
        return stat.S_ISREG(path.lstat().st_mode)
    except (OSError, ValueError):
        return False


def content_digest(data: Mapping[str, Any]) -> str:
    """Return the sha256 of a JSON object without its own digest: keys sorted, no spaces, UTF-8."""
    content = {key: value for key, value in data.items() if key != KEY}
    text = json.dumps(content, sort_keys=True, separators=(",", ":"), ensure_ascii=False, allow_nan=False)
    return hashlib.sha256(text.encode("utf-8", errors="surrogatepass")).hexdigest()


def sealed_mapping(data: Mapping[str, Any]) -> dict[str, Any]:
    """Return a JSON object with its digest as the last key."""
    return {**{key: value for key, value in data.items() if key != KEY}, KEY: content_digest(data)}


def sealed(name: str, content: bytes) -> bytes:
    """Return the content of a .json, .png, .inp, .toml or, with XML's comments, any other file with its seal."""
    if name.endswith(".json"):
        return (json.dumps(sealed_mapping(json.loads(content)), indent=2) + "\n").encode()
    if name.endswith(".png"):
        return content[:_PNG_HEAD] + _png_chunk(content) + content[_PNG_HEAD:]
    return content + _comment(name).format(hashlib.sha256(content).hexdigest()).encode()


def has_seal(path: Path) -> bool:
    """Say whether a path is a file that still is as it was sealed."""
    if not is_regular(path):
        return False
    try:
        content = path.read_bytes()
        if path.suffix == ".json":
            data = json.loads(content)
            return isinstance(data, dict) and data.get(KEY) == content_digest(data)
    except (OSError, ValueError, RecursionError):
        return False
    if path.suffix == ".png":
        length = len(_png_chunk(b""))
        bare = content[:_PNG_HEAD] + content[_PNG_HEAD + length :]
        return content[_PNG_HEAD : _PNG_HEAD + length] == _png_chunk(bare)
    comment = _comment(path.name)
    length = len(comment.format("0" * 64))
    text, line = content[:-length], content[-length:]
    return line == comment.format(hashlib.sha256(text).hexdigest()).encode()


def _comment(name: str) -> str:
    """Return the comment that seals a text file, by the ending of its name."""
    return _COMMENTS.get(Path(name).suffix, _COMMENT)


def without_seal(text: str) -> str:
    """Return a text without the comment that seals it."""
    return _LAST_LINE.sub("", text)


def _png_chunk(content: bytes) -> bytes:
    text = b"tEXt" + _PNG_KEYWORD + hashlib.sha256(content).hexdigest().encode()
    return struct.pack(">I", len(text) - 4) + text + struct.pack(">I", zlib.crc32(text))
