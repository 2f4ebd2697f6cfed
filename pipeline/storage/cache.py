"""Results of stages kept by content: the same inputs and the same code give the stored result, anything else a solve.

An entry is a JSON file named by the digest of stage, inputs, code and library versions, in $XDG_CACHE_HOME/twintip.
"""

import functools
import hashlib
import json
import os
import tempfile
from collections.abc import Callable, Mapping
from importlib.metadata import version
from pathlib import Path
from typing import Any

_SOURCES = ("cad", "mesh", "solve", "pipeline")
_LIBRARIES = ("cadquery", "cadquery-ocp", "gmsh", "lib3mf", "numpy", "scikit-fem", "scipy", "shapely", "trimesh")


def cache_folder() -> Path:
    """Return the one folder of the cache; it need not exist."""
    home = os.environ.get("XDG_CACHE_HOME", "")
    return (Path(home) if Path(home).is_absolute() else Path.home() / ".cache") / "twintip"


@functools.cache
def code_digest() -> str:
    """Return the digest of every source file of the project and of the versions of what it computes with."""
    digest = hashlib.sha256()
    for name in _LIBRARIES:
        digest.update(f"{name}=={version(name)}\n".encode())
    digest.update(sources_digest(Path(__file__).parents[2]).encode())
    return digest.hexdigest()


def sources_digest(root: Path) -> str:
    """Return the digest of every file of the four packages below a folder, at any depth, caches of Python left out."""
    digest = hashlib.sha256()
    for package in _SOURCES:
        for path in sorted((root / package).rglob("*")):
            if path.is_file() and "__pycache__" not in path.parts:
                digest.update(f"{path.relative_to(root).as_posix()} {path.stat().st_size}\n".encode())
                digest.update(path.read_bytes())
    return digest.hexdigest()


def remembered(stage: str, inputs: object, make: Callable[[], Mapping[str, Any]]) -> dict[str, Any]:
    """Return the stored result of a stage for these inputs, or make it and store it; both are plain JSON.

    An entry that cannot be read or whose digest is wrong is made again; a cache that cannot be written is no error.
    """
    text = json.dumps([stage, inputs, code_digest()], sort_keys=True, allow_nan=False)
    path = cache_folder() / f"{stage}-{hashlib.sha256(text.encode()).hexdigest()[:32]}.json"
    found = _read(path)
    if found is not None:
        return found
    # Through JSON also when it is fresh: a stored result and a fresh one are then the same to the last bit.
    body = json.dumps(make(), allow_nan=False)
    _write(path, body)
    made: dict[str, Any] = json.loads(body)
    return made


def _read(path: Path) -> dict[str, Any] | None:
    try:
        digest, _, body = path.read_text(encoding="utf-8").partition("\n")
        if digest != hashlib.sha256(body.encode()).hexdigest():
            return None
        found = json.loads(body)
    except (OSError, ValueError):
        return None
    return found if isinstance(found, dict) else None


def _write(path: Path, body: str) -> None:
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=path.parent) as folder:
            aside = Path(folder) / path.name
            aside.write_text(f"{hashlib.sha256(body.encode()).hexdigest()}\n{body}", encoding="utf-8")
            aside.replace(path)
    except OSError:
        return
