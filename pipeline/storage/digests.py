"""Digests that distinguish a file as a run wrote it from one that a person made or changed."""

import hashlib
import json
import os
import re
import stat
from collections.abc import Mapping
from pathlib import Path
from typing import Any

REPORT = "report.json"
KEY = "digest"
Json = dict[str, Any]
"""A JSON object as read from a file."""
_BACKUP = re.compile(r"(\.[0-9]+)?\.bak$")
_KINDS = (
    (stat.S_ISDIR, "folder"),
    (stat.S_ISLNK, "link"),
    (stat.S_ISFIFO, "pipe"),
    (stat.S_ISSOCK, "socket"),
)
_LONGEST_NAME = 240  # longest name that gets an ending [bytes]; file systems allow 255


def file_digest(path: Path) -> str:
    """Return the sha256 of a file; raises OSError."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def is_regular(path: Path) -> bool:
    """Return whether a path is a regular file, not a link, folder or pipe."""
    try:
        return stat.S_ISREG(path.lstat().st_mode)
    except (OSError, ValueError):
        return False


def kind_of(path: Path) -> str:
    """Return the kind of a path that is no file, as text: folder, link, pipe, socket or device."""
    mode = path.lstat().st_mode
    for is_kind, word in _KINDS:
        if is_kind(mode):
            return word
    return "device"


def has_digest(path: Path, sha256: object) -> bool:
    """Return whether a path is a file with a digest; raises OSError for an unreadable file."""
    try:
        return is_regular(path) and file_digest(path) == sha256
    except FileNotFoundError:  # it was removed meanwhile
        return False


def content_digest(data: Mapping[str, Any]) -> str:
    """Return the sha256 of a JSON object without its own digest: keys sorted, no spaces, UTF-8."""
    content = {key: value for key, value in data.items() if key != KEY}
    text = json.dumps(content, sort_keys=True, separators=(",", ":"), ensure_ascii=False, allow_nan=False)
    return hashlib.sha256(text.encode("utf-8", errors="surrogatepass")).hexdigest()


def with_digest(data: Mapping[str, Any]) -> dict[str, Any]:
    """Return a JSON object with its digest as the last key."""
    return {**{key: value for key, value in data.items() if key != KEY}, KEY: content_digest(data)}


def keep_aside(path: Path, folder: Path) -> None:
    """Move a file or folder into a folder as NAME.bak, or NAME.2.bak and so on; earlier backups keep their names."""
    first = os.fsdecode(os.fsencode(_BACKUP.sub("", path.name))[:_LONGEST_NAME])
    name = path.name if _BACKUP.search(path.name) else f"{first}.bak"
    count = 1
    while os.path.lexists(folder / name):
        count += 1
        name = f"{first}.{count}.bak"
    path.rename(folder / name)
