"""Binary STL [mm], and STL of any origin read as slicers do: triangles with equal corners merged."""

from __future__ import annotations

import re
import tempfile
from dataclasses import dataclass
from pathlib import Path

import cadquery as cq
import numpy as np
import trimesh
from numpy.typing import NDArray

CHORD_MM = 0.005  # largest distance of a triangle from the face that it stands for
ANGLE_RAD = 0.1  # a fillet of 0.5 mm then gets 16 facets a quarter turn
_HEADER_BYTES = 84  # eighty of text, four of the count of triangles
_FACET = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
_FACET_WORD = re.compile(rb"facet\s+normal\s", re.IGNORECASE)
_VERTEX = re.compile(rb"\bvertex\s+(\S+)\s+(\S+)\s+(\S+)", re.IGNORECASE)
_LAST_WORD = re.compile(rb"\bend\s?solid\b[^\n]*\s*\Z", re.IGNORECASE)

Scan = tuple[NDArray[np.floating], NDArray[np.floating] | None, tuple[str, ...]]
"""Corners in the order of the file, normals where they are used, and what was passed over."""


def write_stl(shape: cq.Shape, path: Path, angle: float = ANGLE_RAD) -> None:
    """Write a solid [mm] as binary STL, its facets turned by no more than an angle [rad]; raises OSError."""
    unmeshed = shape.copy()  # triangles stay on a shape: an earlier, finer mesh of it would be written
    unmeshed.exportStl(str(path), CHORD_MM, angle, relative=False, parallel=False)
    if not path.is_file():
        msg = f"STL: cannot write {path}; check that the folder exists and has room"
        raise OSError(msg)


def triangles(shape: cq.Shape, angle: float = ANGLE_RAD) -> trimesh.Trimesh:
    """Return the triangles of a shape [mm]: those of its STL file, or with facets of another angle [rad]."""
    with tempfile.TemporaryDirectory(prefix="twintip-") as folder:
        path = Path(folder) / "shape.stl"
        write_stl(shape, path, angle)
        return read_stl(path)


@dataclass(frozen=True, kw_only=True)
class StlContent:
    """What an STL file holds: its triangles [mm] with equal corners merged, and what of the file was passed over."""

    mesh: trimesh.Trimesh
    passed_over: tuple[str, ...]


def read_stl(path: Path) -> trimesh.Trimesh:
    """Return the triangles of an STL file [mm]; raises ValueError when it holds none."""
    return scan_stl(path).mesh


def scan_stl(path: Path) -> StlContent:
    """Return the content of an STL file [mm], binary or text, as slicers read it.

    A file is text where its size is not that of its count of triangles and it names facets, whatever its first word
    is. Raises ValueError when it holds no triangles.
    """
    data = path.read_bytes()
    is_exact = len(data) == _HEADER_BYTES + _FACET.itemsize * _count(data)
    scan = _scan_text if not is_exact and _FACET_WORD.search(data) else _scan_binary
    try:
        corners, normals, passed_over = scan(data)
    except ValueError as error:
        msg = f"STL: {path.name} has a corner that is no number; export it again"
        raise ValueError(msg) from error
    if len(corners) == 0 or not np.isfinite(corners).all():
        msg = f"STL: {path.name} holds no triangles; export it again"
        raise ValueError(msg)
    faces = np.arange(len(corners)).reshape(-1, 3)
    mesh = trimesh.Trimesh(corners, faces, face_normals=normals, process=False)
    mesh.merge_vertices()
    return StlContent(mesh=mesh, passed_over=passed_over)


def _count(data: bytes) -> int:
    """Return the count of triangles that a binary file tells, 0 for a shorter file."""
    return int.from_bytes(data[_HEADER_BYTES - 4 : _HEADER_BYTES], "little")


def _scan_binary(data: bytes) -> Scan:
    """Return the corners of a binary file: as many as it tells, or all where its count is wrong and its size is not."""
    told = _count(data)
    held, rest = divmod(max(0, len(data) - _HEADER_BYTES), _FACET.itemsize)
    count = told
    passed_over = []
    # Programs that write triangles before they know how many leave a count of 0, or one with every bit set.
    if told == 0 or told > held:
        count = held if rest == 0 else 0
        passed_over.append(f"the count of triangles {told} is passed over for the {count} that are there")
    if after := len(data) - _HEADER_BYTES - _FACET.itemsize * count:
        passed_over.append(f"what stands after the last triangle is passed over, {after} bytes")
    facets = np.frombuffer(data, dtype=_FACET, count=count, offset=_HEADER_BYTES if count else 0)
    return facets["corners"].reshape(-1, 3), facets["normal"], tuple(passed_over)


def _scan_text(data: bytes) -> Scan:
    """Return the corners of a text file; raises ValueError for one that is no number."""
    words = _VERTEX.findall(data)
    spare = len(words) % 3
    passed_over = []
    if spare:
        passed_over.append("a triangle that is cut off is left out")
    if not _LAST_WORD.search(data):
        passed_over.append("there is no endsolid")
    corners = np.array(words[: len(words) - spare], dtype=bytes).astype(np.float64).reshape(-1, 3)
    return corners, None, tuple(passed_over)
