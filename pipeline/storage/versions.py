"""What a result follows from beside its inputs: the source of the program, and the versions of its packages."""

import functools
import hashlib
import platform
import re
from importlib.metadata import PackageNotFoundError, requires, version
from pathlib import Path

_SOURCES = ("sensor", "cad", "mesh", "solve", "pipeline")
_LIBRARIES = ("cadquery", "cadquery-ocp", "gmsh", "lib3mf", "numpy", "scikit-fem", "scipy", "shapely", "trimesh")
_OF_PAGES = (".js", ".css", ".html.j2", ".LICENSE")
"""Endings of files that only show numbers: whoever changes a plot need not solve again."""
_ROOT = Path(__file__).parents[2]
_NAME = re.compile(r"[A-Za-z0-9._-]+")


@functools.cache
def code_digest() -> str:
    """Return the digest of every source file of the project and of the versions of what it computes with."""
    digest = hashlib.sha256()
    for name, number in computing_versions().items():
        digest.update(f"{name}=={number}\n".encode())
    digest.update(sources_digest(_ROOT).encode())
    return digest.hexdigest()


@functools.cache
def pages_digest() -> str:
    """Return the digest of every file that pages are made of, beside the code."""
    return sources_digest(_ROOT, of_pages=True)


def computing_versions() -> dict[str, str]:
    """Return the version of Python and of each package that numbers come from."""
    return {"python": platform.python_version()} | {name: version(name) for name in _LIBRARIES}


def sources_digest(root: Path, *, of_pages: bool = False) -> str:
    """Return the digest of every file of the five packages below a folder, at any depth, that numbers may come from.

    Or of every file `of_pages` alone, which only shows them.
    """
    digest = hashlib.sha256()
    for package in _SOURCES:
        for path in sorted((root / package).rglob("*")):
            shows_numbers = path.name.endswith(_OF_PAGES)
            if path.is_file() and "__pycache__" not in path.parts and shows_numbers == of_pages:
                digest.update(f"{path.relative_to(root).as_posix()} {path.stat().st_size}\n".encode())
                digest.update(path.read_bytes())
    return digest.hexdigest()


def declared_packages() -> tuple[str, ...]:
    """Return the names of the packages that every run needs; none where the program itself is not installed."""
    try:
        texts = requires("twintip") or []
    except PackageNotFoundError:
        return ()
    matches = (_NAME.match(text) for text in texts if "extra ==" not in text)
    return tuple(match[0] for match in matches if match)


@functools.cache
def run_packages() -> dict[str, str | None]:
    """Return the versions of the program and of the packages that every run needs; None for one that is absent."""
    return {name: installed_version(name) for name in ("twintip", *declared_packages())}


def installed_version(name: str) -> str | None:
    """Return the version of a package, None where it is not installed."""
    try:
        return version(name)
    except PackageNotFoundError:
        return None
