"""Binary STL [mm], and STL of any origin: triangles with equal corners merged."""

from __future__ import annotations

import re
import tempfile
from pathlib import Path

import cadquery as cq
import numpy as np
import trimesh

CHORD_MM = 0.005  # largest distance of a triangle from the face that it stands for
ANGLE_RAD = 0.1  # a fillet of 0.5 mm then gets 16 facets a quarter turn
_HEADER_BYTES = 84  # eighty of text, four of the count of triangles
_FACET = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
_FACET_WORD = re.compile(rb"facet\s+normal\s", re.IGNORECASE)
_VERTEX = re.compile(rb"\bvertex\s+(\S+)\s+(\S+)\s+(\S+)", re.IGNORECASE)


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


def read_stl(path: Path) -> trimesh.Trimesh:
    """Return the triangles of an STL file [mm], binary or text; raises ValueError when it holds none.

    A file is text where its size is not that of its count of triangles and it names facets, whatever its first word
    is.
    """
    data = path.read_bytes()
    is_exact = len(data) == _HEADER_BYTES + _FACET.itemsize * _count(data)
    normals = None
    try:
        if is_exact or not _FACET_WORD.search(data):
            facets = np.frombuffer(data, dtype=_FACET, offset=_HEADER_BYTES)
            corners, normals = facets["corners"].reshape(-1, 3), facets["normal"]
        else:
            corners = np.array(_VERTEX.findall(data), dtype=bytes).astype(np.float64).reshape(-1, 3)
        faces = np.arange(len(corners)).reshape(-1, 3)
    except ValueError as error:
        msg = f"STL: {path.name} is cut off, or has a corner that is no number; export it again"
        raise ValueError(msg) from error
    if len(corners) == 0 or not np.isfinite(corners).all():
        msg = f"STL: {path.name} holds no triangles; export it again"
        raise ValueError(msg)
    mesh = trimesh.Trimesh(corners, faces, face_normals=normals, process=False)
    mesh.merge_vertices()
    return mesh


def _count(data: bytes) -> int:
    """Return the count of triangles in the header of a binary file, 0 for a shorter file."""
    return int.from_bytes(data[_HEADER_BYTES - 4 : _HEADER_BYTES], "little")
