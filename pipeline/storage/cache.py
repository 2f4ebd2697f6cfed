"""A cache of the results of stages: a stage with equal inputs and equal code is not solved again.

An entry is a JSON file in $XDG_CACHE_HOME/twintip. Its name contains a digest of the stage, its inputs, the code, and
the versions of the libraries.
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
_MAX_BYTES = 256 * 2**20  # maximum size of an entry [bytes], for comparison: the files of a design take a few MiB


def cache_folder() -> Path | None:
    """Return the folder of the cache, which may not exist yet; None for a user without a home folder."""
    cache_home = Path(os.environ.get("XDG_CACHE_HOME", ""))
    if cache_home.is_absolute():
        return cache_home / "twintip"
    try:
        home = Path.home()
    except RuntimeError:
        return None
    return home / ".cache" / "twintip" if home.is_absolute() else None


def load_or_compute(stage: str, inputs: object, compute: Callable[[], T], kind: type[T]) -> T:
    """Return the stored result of a stage for these inputs, or call `compute` and store its result.

    `stage` is the name of the stage. The inputs are records or plain data, and the result is of type `kind`. Even a new
    result is converted to JSON and back, so that it is identical to a result that a later run loads.
    """
    stored_result = load_stored(stage, inputs, kind)
    if stored_result is not None:
        return stored_result
    new_result = compute()
    store(stage, inputs, new_result)
    return from_plain(kind, json.loads(_as_json(new_result)))


def load_stored(stage: str, inputs: object, kind: type[T]) -> T | None:
    """Return the stored result of a stage for these inputs, or None if there is no valid entry.

    The result is of type `kind`. An entry is invalid if it is too large, incomplete, changed, or of another type. An
    invalid entry is treated as missing, so that the stage is solved again.
    """
    path = _entry_path(stage, inputs)
    if path is None or not is_regular(path):
        return None
    try:
        if path.stat().st_size > _MAX_BYTES:
            return None
        digest, _, body = path.read_text(encoding="utf-8").partition("\n")
        if digest != _digest(path, body):
            return None
        return from_plain(kind, json.loads(body))
    except (OSError, ValueError, RecursionError):
        return None


def store(stage: str, inputs: object, result: object) -> None:
    """Store the result of a stage for these inputs, so that a later run does not need to solve it again.

    The entry is written to a temporary file, which is then renamed, so that no other process reads an incomplete entry.
    Nothing is stored if the cache cannot be written, or if something other than a regular file exists at the path of
    the entry. No error is raised then, because a run does not depend on the cache.
    """
    path = _entry_path(stage, inputs)
    if path is None or (os.path.lexists(path) and not is_regular(path)):
        return
    body = _as_json(result)
    part = path.with_name(f"{path.name}.{os.getpid()}.part")
    with suppress(OSError):
        path.parent.mkdir(parents=True, exist_ok=True)
        for unfinished in path.parent.glob(f"{path.name}.*.part"):  # left behind by a killed process
            unfinished.unlink()
        try:
            with part.open("x", encoding="utf-8") as file:  # "x" does not follow a symbolic link
                file.write(f"{_digest(path, body)}\n{body}")
            part.replace(path)
        finally:
            part.unlink(missing_ok=True)


def _entry_path(stage: str, inputs: object) -> Path | None:
    """Return the path of the entry for a result; None if there is no folder for the cache.

    The name contains a digest of everything on which the result depends.
    """
    folder = cache_folder()
    if folder is None:
        return None
    text = json.dumps([stage, to_plain(inputs), code_digest()], sort_keys=True, allow_nan=False)
    return folder / f"{stage}-{hashlib.sha256(text.encode()).hexdigest()[:32]}.json"


def _as_json(result: object) -> str:
    """Return a result as JSON; raises ValueError for a number that is not finite."""
    return json.dumps(to_plain(result), allow_nan=False)


def _digest(path: Path, body: str) -> str:
    """Return the digest of an entry; it covers the name of the file, so that a copy with another name is invalid."""
    return hashlib.sha256(f"{path.name}\n{body}".encode()).hexdigest()
