"""Whose is a file in an output folder: ours where the report lists it with the digest it still has, else a person's."""

import json
import os
import re
from pathlib import Path

from pipeline.storage.seal import file_digest, has_seal, is_regular

REPORT = "report.json"
_KEPT = re.compile(r"\.bak(\.[0-9]+)?$")
_LONGEST_NAME = 240  # bytes of a name that gets an ending; file systems take 255


def own_files(folder: Path) -> list[str]:
    """Return the names of the files in a folder that are as the last run wrote them, its report.json last.

    None are where the report is missing or was changed.
    """
    path = folder / REPORT
    if not has_seal(path):
        return []
    listed = _digests(json.loads(path.read_bytes()))
    return [*(name for name in _names(folder) if _has_digest(folder / name, listed.get(name))), REPORT]


def foreign_files(folder: Path) -> list[str]:
    """Return the names of what is in a folder and not as the last run wrote it, links, pipes and folders too.

    They are sorted, but that of a report which is not ours comes first: then nothing else is. Raises OSError where the
    folder cannot be read.
    """
    own = set(own_files(folder))
    return sorted((name for name in _names(folder) if name not in own), key=lambda name: (name != REPORT, name))


def is_whole(folder: Path) -> bool:
    """Say whether a folder holds every file of the last run as it was written, and nothing else.

    Raises OSError where the folder cannot be read.
    """
    own = own_files(folder)
    if REPORT not in own or sorted(own) != _names(folder):
        return False
    return set(_digests(json.loads((folder / REPORT).read_bytes()))) <= set(own)


def keep_aside(path: Path, folder: Path) -> None:
    """Move a file or folder into a folder as NAME.bak, or NAME.bak.1 and so on; one kept before keeps its name."""
    name = path.name if _KEPT.search(path.name) else os.fsdecode(os.fsencode(path.name)[:_LONGEST_NAME]) + ".bak"
    first, count = re.sub(r"\.[0-9]+$", "", name), 0
    while os.path.lexists(folder / name):
        count += 1
        name = f"{first}.{count}"
    path.rename(folder / name)


def _names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def _digests(report: dict[str, object]) -> dict[str, object]:
    """Return sha256 by path of the files that a report lists."""
    entries = report.get("files")
    entries = entries if isinstance(entries, list) else []
    return {str(entry.get("path")): entry.get("sha256") for entry in entries if isinstance(entry, dict)}


def _has_digest(path: Path, sha256: object) -> bool:
    try:
        return sha256 is not None and is_regular(path) and file_digest(path) == sha256
    except OSError:
        return False
