"""Results of stages kept by content: the same inputs and the same code give the stored result, anything else a solve.

An entry is a JSON file named by the digest of stage, inputs, code and library versions, in $XDG_CACHE_HOME/twintip.
"""

import hashlib
import json
import os
import stat
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

from pipeline.storage.plain import from_plain, to_plain
from pipeline.storage.versions import code_digest

T = TypeVar("T")


def cache_folder() -> Path | None:
    """Return the one folder of the cache, which need not exist; None for a user who has no home."""
    given = Path(os.environ.get("XDG_CACHE_HOME", ""))
    if given.is_absolute():
        return given / "twintip"
    try:
        home = Path.home()
    except RuntimeError:
        return None
    return home / ".cache" / "twintip" if home.is_absolute() else None


def cached(stage: str, inputs: object, compute: Callable[[], T], kind: type[T]) -> T:
    """Return the stored result of a stage for these inputs, or compute it and store it.

    Inputs are records or plain data. An entry that cannot be read or whose digest is wrong is computed again; a cache
    that cannot be written is no error. A fresh result goes through JSON too, so that it equals a stored one to the bit.
    """
    path = _entry(stage, inputs)
    body = _read(path)
    if body is None:
        body = _body(compute())
        _write(path, body)
    return from_plain(kind, json.loads(body))


def stored(stage: str, inputs: object, kind: type[T]) -> T | None:
    """Return the stored result of a stage for these inputs; None where there is none."""
    body = _read(_entry(stage, inputs))
    return None if body is None else from_plain(kind, json.loads(body))


def is_kept(stage: str, inputs: object) -> bool:
    """Say whether a result of a stage is stored for these inputs."""
    return _read(_entry(stage, inputs)) is not None


def store(stage: str, inputs: object, result: object) -> None:
    """Store the result of a stage for these inputs; a cache that cannot be written is no error."""
    _write(_entry(stage, inputs), _body(result))


def _entry(stage: str, inputs: object) -> Path | None:
    """Return the file of a result; None where there is no cache."""
    folder = cache_folder()
    if folder is None:
        return None
    text = json.dumps([stage, to_plain(inputs), code_digest()], sort_keys=True, allow_nan=False)
    return folder / f"{stage}-{hashlib.sha256(text.encode()).hexdigest()[:32]}.json"


def _body(result: object) -> str:
    return json.dumps(to_plain(result), allow_nan=False)


def _read(path: Path | None) -> str | None:
    """Return the text of an entry; None where it is missing, damaged or no regular file."""
    try:
        if path is None or not stat.S_ISREG(path.lstat().st_mode):
            return None
        digest, _, body = path.read_text(encoding="utf-8").partition("\n")
    except (OSError, ValueError):
        return None
    return body if digest == hashlib.sha256(body.encode()).hexdigest() else None


def _write(path: Path | None, body: str) -> None:
    """Write an entry aside and rename it; a cache that cannot be written is no error."""
    if path is None:
        return
    part = path.with_name(f"{path.name}.{os.getpid()}.part")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        part.write_text(f"{hashlib.sha256(body.encode()).hexdigest()}\n{body}", encoding="utf-8")
        part.replace(path)
    except OSError:
        return
