"""Binary STL [mm], read back as triangles with equal corners merged."""

from __future__ import annotations

import struct
import tempfile
from pathlib import Path

import cadquery as cq
import numpy as np
import trimesh

CHORD_MM = 0.005  # largest distance of a triangle from the face that it stands for
ANGLE_RAD = 0.1  # a fillet of 0.5 mm then gets 16 facets a quarter turn


def write_stl(shape: cq.Shape, path: Path) -> None:
    """Write a solid [mm] as binary STL; raises OSError."""
    unmeshed = shape.copy()  # triangles stay on a shape: an earlier, finer mesh of it would be written
    unmeshed.exportStl(str(path), CHORD_MM, ANGLE_RAD, relative=False, parallel=False)
    if not path.is_file():
        msg = f"STL: cannot write {path}; check that the folder exists and has room"
        raise OSError(msg)


def triangles(shape: cq.Shape) -> trimesh.Trimesh:
    """Return the triangles of a shape [mm]: those of its STL file."""
    with tempfile.TemporaryDirectory(prefix="twintip-") as folder:
        path = Path(folder) / "shape.stl"
        write_stl(shape, path)
        return read_stl(path)


def read_stl(path: Path) -> trimesh.Trimesh:
    """Return the triangles of an STL file [mm]; raises ValueError when it holds none."""
    no_triangles = f"STL: {path.name} holds no triangles; export it again"
    try:
        mesh = trimesh.load_mesh(path, file_type="stl", process=False)
    except (ValueError, KeyError, IndexError, struct.error) as error:
        raise ValueError(no_triangles) from error
    if len(mesh.faces) == 0 or not np.isfinite(mesh.vertices).all():
        raise ValueError(no_triangles)
    mesh.merge_vertices()
    return mesh
