"""Cache of stage results by content: equal inputs and code give the stored result, anything else is solved.

An entry is a JSON file named by the digest of stage, inputs, code and library versions, in $XDG_CACHE_HOME/twintip.
"""

import hashlib
import json
import os
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import TypeVar

from pipeline.storage.digests import is_regular
from pipeline.storage.plain import from_plain, to_plain
from pipeline.storage.versions import code_digest

T = TypeVar("T")
_MOST_BYTES = 256 * 2**20  # largest entry; the base64 files of a design are a few MiB


def cache_folder() -> Path | None:
    """Return the folder of the cache, which need not exist; None for a user without a home."""
    given = Path(os.environ.get("XDG_CACHE_HOME", ""))
    if given.is_absolute():
        return given / "twintip"
    try:
        home = Path.home()
    except RuntimeError:
        return None
    return home / ".cache" / "twintip" if home.is_absolute() else None


def cached(stage: str, inputs: object, compute: Callable[[], T], kind: type[T]) -> T:
    """Return the stored result of a stage for these inputs, or compute and store it.

    Inputs are records or plain data. A fresh result passes through JSON too, so that it equals a stored one bit by bit.
    """
    result = stored(stage, inputs, kind)
    if result is not None:
        return result
    fresh = compute()
    store(stage, inputs, fresh)
    return from_plain(kind, json.loads(_as_json(fresh)))


def stored(stage: str, inputs: object, kind: type[T]) -> T | None:
    """Return the stored result of a stage for these inputs; None without a valid entry."""
    path = _entry(stage, inputs)
    if path is None or not is_regular(path):
        return None
    try:
        if path.stat().st_size > _MOST_BYTES:
            return None
        digest, _, body = path.read_text(encoding="utf-8").partition("\n")
        if digest != _digest(path, body):
            return None
        return from_plain(kind, json.loads(body))
    except (OSError, ValueError, RecursionError):
        return None


def store(stage: str, inputs: object, result: object) -> None:
    """Write the result of a stage for these inputs aside and rename it.

    An unwritable cache is no error; a path that is not a regular file is not replaced.
    """
    path = _entry(stage, inputs)
    if path is None or (os.path.lexists(path) and not is_regular(path)):
        return
    body = _as_json(result)
    part = path.with_name(f"{path.name}.{os.getpid()}.part")
    with suppress(OSError):
        path.parent.mkdir(parents=True, exist_ok=True)
        for left in path.parent.glob(f"{path.name}.*.part"):  # left by a killed process
            left.unlink()
        try:
            with part.open("x", encoding="utf-8") as file:  # "x" does not follow a link
                file.write(f"{_digest(path, body)}\n{body}")
            part.replace(path)
        finally:
            part.unlink(missing_ok=True)


def _entry(stage: str, inputs: object) -> Path | None:
    """Return the file of a result; None without a cache."""
    folder = cache_folder()
    if folder is None:
        return None
    text = json.dumps([stage, to_plain(inputs), code_digest()], sort_keys=True, allow_nan=False)
    return folder / f"{stage}-{hashlib.sha256(text.encode()).hexdigest()[:32]}.json"


def _as_json(result: object) -> str:
    return json.dumps(to_plain(result), allow_nan=False)


def _digest(path: Path, body: str) -> str:
    """Return the digest of an entry and its name, so that an entry copied to another name is invalid."""
    return hashlib.sha256(f"{path.name}\n{body}".encode()).hexdigest()
