"""Results of stages kept by content: the same inputs and the same code give the stored result, anything else a solve.

An entry is a JSON file named by the digest of stage, inputs, code and library versions, in $XDG_CACHE_HOME/twintip.
"""

import functools
import hashlib
import json
import os
import platform
from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path
from typing import TypeVar

from pipeline.storage.packages import installed_version
from pipeline.storage.plain import from_plain, to_plain

T = TypeVar("T")

_SOURCES = ("cad", "mesh", "solve", "pipeline")
_LIBRARIES = ("cadquery", "cadquery-ocp", "gmsh", "lib3mf", "numpy", "scikit-fem", "scipy", "shapely", "trimesh")
_OPTIONAL = ("mkl", "pypardiso")  # another direct solver where they are installed


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


@functools.cache
def code_digest() -> str:
    """Return the digest of every source file of the project and of the versions of what it computes with."""
    digest = hashlib.sha256()
    for name, number in computing_versions().items():
        digest.update(f"{name}=={number}\n".encode())
    digest.update(sources_digest(Path(__file__).parents[2]).encode())
    return digest.hexdigest()


def computing_versions() -> dict[str, str | None]:
    """Return the version of Python and of each package that numbers come from; None for an optional one not there."""
    found: dict[str, str | None] = {"python": platform.python_version()}
    found |= {name: version(name) for name in _LIBRARIES}
    found |= {name: installed_version(name) for name in _OPTIONAL}
    return found


def sources_digest(root: Path) -> str:
    """Return the digest of every file of the four packages below a folder, at any depth, caches of Python left out."""
    digest = hashlib.sha256()
    for package in _SOURCES:
        for path in sorted((root / package).rglob("*")):
            if path.is_file() and "__pycache__" not in path.parts:
                digest.update(f"{path.relative_to(root).as_posix()} {path.stat().st_size}\n".encode())
                digest.update(path.read_bytes())
    return digest.hexdigest()


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
    """Return the text of an entry; None where it is missing or damaged."""
    if path is None:
        return None
    try:
        digest, _, body = path.read_text(encoding="utf-8").partition("\n")
    except (OSError, ValueError):
        return None
    return body if digest == hashlib.sha256(body.encode()).hexdigest() else None


def _write(path: Path | None, body: str) -> None:
    """Write an entry in its place; one that is only half there, after a kill or beside another run, is damaged."""
    if path is None:
        return
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(f"{hashlib.sha256(body.encode()).hexdigest()}\n{body}", encoding="utf-8")
    except OSError:
        return
