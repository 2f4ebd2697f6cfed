"""STL files [mm]: written in binary form, and read in binary or text form, with equal vertices merged."""

from __future__ import annotations

import re
import tempfile
from pathlib import Path
from typing import Any

import cadquery as cq
import numpy as np
import trimesh
from numpy.typing import NDArray

CHORD_MM = 0.005  # largest distance between a triangle and the face that it approximates
ANGLE_RAD = 0.1  # largest angle between neighbouring facets, which gives 16 facets per quarter circle
_HEADER_BYTES = 84  # 80 bytes of text, and 4 bytes for the number of triangles
# The 50 bytes of a facet in a binary file.
_FACET = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
_FACET_WORD = re.compile(rb"facet\s+normal\s", re.IGNORECASE)
_VERTEX = re.compile(rb"\bvertex\s+(\S+)\s+(\S+)\s+(\S+)", re.IGNORECASE)


def write_stl(shape: cq.Shape, path: Path, angle: float = ANGLE_RAD) -> None:
    """Write a solid [mm] as binary STL.

    The normals of neighbouring facets on a curved face differ by at most `angle` [rad]. Raises OSError if the file
    cannot be written.
    """
    unmeshed = shape.copy()  # without the copy, an earlier, finer mesh of the shape would be written
    unmeshed.exportStl(str(path), CHORD_MM, angle, relative=False, parallel=False)
    if not path.is_file():
        msg = f"STL: cannot write {path}. Check that the folder exists and the disk is not full."
        raise OSError(msg)


def triangles(shape: cq.Shape, angle: float = ANGLE_RAD) -> trimesh.Trimesh:
    """Return the triangles of a shape [mm] that its STL file would hold. They are read from a temporary STL file.

    The normals of neighbouring facets on a curved face differ by at most `angle` [rad].
    """
    with tempfile.TemporaryDirectory(prefix="twintip-") as folder:
        path = Path(folder) / "shape.stl"
        write_stl(shape, path, angle)
        return read_stl(path)


def read_stl(path: Path) -> trimesh.Trimesh:
    """Return the triangles [mm] of a binary or text STL file. The normals of a binary file are kept.

    Raises ValueError if the file is damaged or has no triangles.
    """
    data = path.read_bytes()
    try:
        corners, normals = _corners_and_normals(data)
        faces = np.arange(len(corners)).reshape(-1, 3)  # raises ValueError if the last triangle is incomplete
    except ValueError as error:
        msg = f"STL: {path.name} is truncated, or a coordinate is not a number; export it again"
        raise ValueError(msg) from error
    if len(corners) == 0 or not np.isfinite(corners).all():
        msg = f"STL: {path.name} holds no triangles; export it again"
        raise ValueError(msg)
    mesh = trimesh.Trimesh(corners, faces, face_normals=normals, process=False)
    mesh.merge_vertices()
    return mesh


def _corners_and_normals(data: bytes) -> tuple[NDArray[Any], NDArray[Any] | None]:
    """Return the corners (3 n, 3) [mm] of the n triangles in an STL file, three for each, and the normals (n, 3).

    Text files begin with the word `solid`, but some binary files do too. So a file is read as binary if its size agrees
    with its number of triangles, or if the words `facet normal` are missing. For a text file, the normals are None, and
    trimesh computes them from the corners. Raises ValueError if the file is damaged.
    """
    has_binary_size = len(data) == _HEADER_BYTES + _FACET.itemsize * _triangle_count(data)
    if has_binary_size or not _FACET_WORD.search(data):
        facets = np.frombuffer(data, dtype=_FACET, offset=_HEADER_BYTES)
        return facets["corners"].reshape(-1, 3), facets["normal"]
    return np.array(_VERTEX.findall(data), dtype=bytes).astype(np.float64).reshape(-1, 3), None


def _triangle_count(data: bytes) -> int:
    """Return the number of triangles in the header of a binary file, or 0 if the file is shorter than a header."""
    return int.from_bytes(data[_HEADER_BYTES - 4 : _HEADER_BYTES], "little")
