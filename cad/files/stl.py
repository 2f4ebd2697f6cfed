"""Binary STL [mm] with bytes that depend on nothing but the solid; read back as triangles."""

import os
import struct
from pathlib import Path

import numpy as np
import numpy.typing as npt
import trimesh

from cad.kernel import cq

Floats = npt.NDArray[np.float64]
Indices = npt.NDArray[np.int64]
CHORD_MM = 0.005  # largest distance of a triangle from the face that it stands for
ANGLE_RAD = 0.1  # a fillet of 0.5 mm then gets 16 facets a quarter turn
PICTURE_CHORD_MM, PICTURE_ANGLE_RAD = 0.15, 0.35


def write_stl(shape: cq.Shape, path: Path) -> None:
    """Write a solid [mm] as binary STL; raises OSError."""
    fresh = shape.copy()  # triangles stay on a shape: an earlier, finer mesh of it would change the bytes
    fresh.exportStl(str(path), CHORD_MM, ANGLE_RAD, relative=False, parallel=False)
    if not path.is_file():
        msg = f"STL: cannot write {path}; check that the folder exists and has room"
        raise OSError(msg)


def triangles(shape: cq.Shape) -> trimesh.Trimesh:
    """Return a shape [mm] as triangles with equal corners merged, as fine as the STL."""
    with os.fdopen(os.memfd_create("shape.stl")) as in_memory:  # a file on a disk would stay there after a kill
        path = Path(f"/proc/self/fd/{in_memory.fileno()}")
        write_stl(shape, path)
        return read_stl(path)


def read_stl(path: Path) -> trimesh.Trimesh:
    """Return the triangles of an STL file [mm] with equal corners merged; raises ValueError when it holds none."""
    try:
        mesh = trimesh.load_mesh(path, file_type="stl", process=True)
    except (ValueError, KeyError, IndexError, struct.error) as error:
        raise _unreadable(path) from error
    if len(mesh.faces) == 0:
        raise _unreadable(path)
    return mesh


def coarse_triangles(shape: cq.Shape) -> Floats:
    """Return a shape as triangles for a picture of it, shape (triangles, 3 corners, 3) [mm]."""
    vertices, corners = shape.copy().tessellate(PICTURE_CHORD_MM, PICTURE_ANGLE_RAD)
    places = np.array([vertex.toTuple() for vertex in vertices])
    return np.asarray(places[np.array(corners)])


def _unreadable(path: Path) -> ValueError:
    return ValueError(f"STL: {path.name} holds no triangles; export it again")
