"""Binary STL [mm] with bytes that depend on nothing but the solid; read back as triangles."""

from __future__ import annotations

import os
import struct
from pathlib import Path

import cadquery as cq
import numpy as np
import trimesh

from cad.triangles import Floats, Triangles, merged

CHORD_MM = 0.005  # largest distance of a triangle from the face that it stands for
ANGLE_RAD = 0.1  # a fillet of 0.5 mm then gets 16 facets a quarter turn
_HEADER = 84  # bytes, the last four of them the number of triangles
_BINARY = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
PICTURE_CHORD_MM, PICTURE_ANGLE_RAD = 0.15, 0.35


def write_stl(shape: cq.Shape, path: Path) -> None:
    """Write a solid [mm] as binary STL; raises OSError."""
    fresh = shape.copy()  # triangles stay on a shape: an earlier, finer mesh of it would change the bytes
    fresh.exportStl(str(path), CHORD_MM, ANGLE_RAD, relative=False, parallel=False)
    if not path.is_file():
        msg = f"STL: cannot write {path}; check that the folder exists and has room"
        raise OSError(msg)


def triangles(shape: cq.Shape) -> Triangles:
    """Return a shape [mm] as triangles with equal corners merged, as fine as the STL."""
    with os.fdopen(os.memfd_create("shape.stl")) as in_memory:  # a file on a disk would stay there after a kill
        path = Path(f"/proc/self/fd/{in_memory.fileno()}")
        write_stl(shape, path)
        return read_stl(path)


def read_stl(path: Path) -> Triangles:
    """Return the triangles of an STL file [mm] with equal corners merged; raises ValueError when it holds none."""
    data = path.read_bytes()
    count = int.from_bytes(data[_HEADER - 4 : _HEADER], "little")
    if count and len(data) == _HEADER + count * _BINARY.itemsize:
        corners = np.frombuffer(data, _BINARY, offset=_HEADER)["corners"].astype(np.float64)
        if np.isfinite(corners).all():
            return merged(corners)
    try:  # a text, or a file that is damaged
        mesh = trimesh.load_mesh(path, file_type="stl", process=True)
    except (ValueError, KeyError, IndexError, struct.error) as error:
        raise _unreadable(path) from error
    if len(mesh.faces) == 0:
        raise _unreadable(path)
    return Triangles(vertices=np.asarray(mesh.vertices), faces=np.asarray(mesh.faces))


def coarse_triangles(shape: cq.Shape) -> Floats:
    """Return a shape as triangles for a picture of it, shape (triangles, 3 corners, 3) [mm]."""
    vertices, corners = shape.copy().tessellate(PICTURE_CHORD_MM, PICTURE_ANGLE_RAD)
    places = np.array([vertex.toTuple() for vertex in vertices])
    return np.asarray(places[np.array(corners)])


def _unreadable(path: Path) -> ValueError:
    return ValueError(f"STL: {path.name} holds no triangles; export it again")
