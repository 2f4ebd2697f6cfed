"""Digests that distinguish files written by a run from files that a user created or changed."""

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
"""A JSON object that was read from a file."""
_BACKUP = re.compile(r"(\.[0-9]+)?\.bak$")  # the end of a name that `keep_aside` gives, as in NAME.bak and NAME.2.bak
_KINDS = (
    (stat.S_ISDIR, "folder"),
    (stat.S_ISLNK, "link"),
    (stat.S_ISFIFO, "pipe"),
    (stat.S_ISSOCK, "socket"),
)
_MAX_NAME_BYTES = 240  # names are truncated to this length before the suffix is added; file systems allow 255 [bytes]


def file_digest(path: Path) -> str:
    """Return the SHA-256 digest of a file; raises OSError if the file cannot be read."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def is_regular(path: Path) -> bool:
    """Return whether a path is a regular file rather than a link, a folder or a pipe."""
    try:
        return stat.S_ISREG(path.lstat().st_mode)
    except (OSError, ValueError):
        return False


def kind_of(path: Path) -> str:
    """Return the kind of a path that is not a regular file: folder, link, pipe, socket or device."""
    mode = path.lstat().st_mode
    for is_of_kind, kind in _KINDS:
        if is_of_kind(mode):
            return kind
    return "device"


def has_digest(path: Path, sha256: object) -> bool:
    """Return whether a path is a regular file with the digest `sha256`; raises OSError if it cannot be read."""
    try:
        return is_regular(path) and file_digest(path) == sha256
    except FileNotFoundError:  # the file was removed between the two checks
        return False


def content_digest(data: Mapping[str, Any]) -> str:
    """Return the SHA-256 digest of a JSON object without its key `digest`.

    The object is written in UTF-8, with sorted keys and without spaces.
    """
    content = {key: value for key, value in data.items() if key != KEY}
    text = json.dumps(content, sort_keys=True, separators=(",", ":"), ensure_ascii=False, allow_nan=False)
    return hashlib.sha256(text.encode("utf-8", errors="surrogatepass")).hexdigest()


def with_digest(data: Mapping[str, Any]) -> dict[str, Any]:
    """Return the JSON object with its digest as the last key."""
    return {**{key: value for key, value in data.items() if key != KEY}, KEY: content_digest(data)}


def keep_aside(path: Path, folder: Path) -> None:
    """Move a file or folder of the user into `folder` as a backup, without replacing anything.

    The backup gets the first unused name of NAME.bak, NAME.2.bak, NAME.3.bak and so on. A path that already has the
    name of a backup keeps this name if it is unused in `folder`.
    """
    # The name is truncated as bytes, because file systems limit the number of bytes and not of characters.
    stem = os.fsdecode(os.fsencode(_BACKUP.sub("", path.name))[:_MAX_NAME_BYTES])
    name = path.name if _BACKUP.search(path.name) else f"{stem}.bak"
    count = 1
    while os.path.lexists(folder / name):
        count += 1
        name = f"{stem}.{count}.bak"
    path.rename(folder / name)
