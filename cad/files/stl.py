"""Binary STL [mm], read back as triangles with merged corners."""

from __future__ import annotations

import struct
import tempfile
from pathlib import Path

import cadquery as cq
import numpy as np
import trimesh

from cad.triangles import Triangles, merged

CHORD_MM = 0.005  # largest distance of a triangle from the face that it stands for
ANGLE_RAD = 0.1  # a fillet of 0.5 mm then gets 16 facets a quarter turn


def write_stl(shape: cq.Shape, path: Path) -> None:
    """Write a solid [mm] as binary STL; raises OSError."""
    unmeshed = shape.copy()  # triangles stay on a shape: an earlier, finer mesh of it would be written
    unmeshed.exportStl(str(path), CHORD_MM, ANGLE_RAD, relative=False, parallel=False)
    if not path.is_file():
        msg = f"STL: cannot write {path}; check that the folder exists and has room"
        raise OSError(msg)


def triangles(shape: cq.Shape) -> Triangles:
    """Return a shape [mm] as triangles with equal corners merged: those of its STL file."""
    with tempfile.TemporaryDirectory(prefix="twintip-") as folder:
        path = Path(folder) / "shape.stl"
        write_stl(shape, path)
        return read_stl(path)


def read_stl(path: Path) -> Triangles:
    """Return the triangles of an STL file [mm] with equal corners merged; raises ValueError when it holds none."""
    try:
        mesh = trimesh.load_mesh(path, file_type="stl", process=False)
        corners = np.asarray(mesh.triangles, dtype=np.float64)
    except (ValueError, KeyError, IndexError, struct.error) as error:
        raise _unreadable(path) from error
    if len(corners) == 0 or not np.isfinite(corners).all():
        raise _unreadable(path)
    return merged(corners)


def _unreadable(path: Path) -> ValueError:
    return ValueError(f"STL: {path.name} holds no triangles; export it again")
