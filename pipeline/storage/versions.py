"""Digests of the source code and versions of the packages, on which results depend in addition to their inputs."""

import functools
import hashlib
import platform
import re
from importlib.metadata import PackageNotFoundError, requires, version
from pathlib import Path

_SOURCES = ("sensor", "cad", "mesh", "solve", "pipeline")
_LIBRARIES = ("cadquery", "cadquery-ocp", "gmsh", "lib3mf", "numpy", "scikit-fem", "scipy", "shapely", "trimesh")
_PAGE_SUFFIXES = (".js", ".css", ".html.j2", ".LICENSE")
"""Suffixes of files that only display numbers. If such a file changes, nothing needs to be solved again."""
_ROOT = Path(__file__).parents[2]
_NAME = re.compile(r"[A-Za-z0-9._-]+")  # the name at the start of a requirement such as numpy>=2,<3


@functools.cache
def code_digest() -> str:
    """Return a digest of all source files and package versions that may affect numbers."""
    digest = hashlib.sha256()
    for name, number in computing_versions().items():
        digest.update(f"{name}=={number}\n".encode())
    digest.update(sources_digest(_ROOT).encode())
    return digest.hexdigest()


@functools.cache
def pages_digest() -> str:
    """Return a digest of the scripts, style sheets and templates of all pages."""
    return sources_digest(_ROOT, of_pages=True)


def computing_versions() -> dict[str, str]:
    """Return the version of Python and of each package that computes numbers."""
    return {"python": platform.python_version()} | {name: version(name) for name in _LIBRARIES}


def sources_digest(root: Path, *, of_pages: bool = False) -> str:
    """Return a digest of the source files in the project folder `root` that may affect numbers.

    With `of_pages`, the digest covers the files that only display numbers instead. The files are sorted, because the
    digest depends on their order.
    """
    digest = hashlib.sha256()
    for package in _SOURCES:
        for path in sorted((root / package).rglob("*")):
            is_of_pages = path.name.endswith(_PAGE_SUFFIXES)
            if path.is_file() and "__pycache__" not in path.parts and is_of_pages == of_pages:
                # The size separates the content of a file from the name of the next file. Without the size, bytes could
                # move from the content to the name without a change in the digest.
                digest.update(f"{path.relative_to(root).as_posix()} {path.stat().st_size}\n".encode())
                digest.update(path.read_bytes())
    return digest.hexdigest()


def declared_packages() -> tuple[str, ...]:
    """Return the names of the packages that every run needs; empty if this program is not installed as a package."""
    try:
        requirements = requires("twintip") or []
    except PackageNotFoundError:
        return ()
    matches = (_NAME.match(requirement) for requirement in requirements if "extra ==" not in requirement)
    return tuple(match[0] for match in matches if match)


@functools.cache
def run_packages() -> dict[str, str | None]:
    """Return the version of this program and of each package that every run needs; None for a missing package."""
    return {name: installed_version(name) for name in ("twintip", *declared_packages())}


def installed_version(name: str) -> str | None:
    """Return the version of a package, or None if it is not installed."""
    try:
        return version(name)
    except PackageNotFoundError:
        return None
