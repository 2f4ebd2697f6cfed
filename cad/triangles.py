"""The surface of a solid as triangles."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]
Indices = npt.NDArray[np.int64]
_MERGED = 1e8  # [1/mm] corners that agree to its inverse are one, well under single precision at 1 mm


@dataclass(frozen=True, kw_only=True)
class Triangles:
    """Triangles on shared corners: `vertices` (n, 3) [mm], `faces` (m, 3) their indices, counterclockwise outside."""

    vertices: Floats
    faces: Indices

    @property
    def triangles(self) -> Floats:
        """Return the corners of every triangle, shape (m, 3 corners, 3) [mm]."""
        return np.asarray(self.vertices[self.faces])

    @property
    def volume(self) -> float:
        """Return the volume inside [mm^3]."""
        return enclosed_volume(self.triangles)


def enclosed_volume(triangles: Floats) -> float:
    """Return the volume [mm^3] inside triangles (m, 3, 3) [mm], from the divergence theorem."""
    a, b, c = (triangles - triangles.min(axis=(0, 1))).transpose(1, 0, 2)
    return float(np.einsum("ij,ij->", a, np.cross(b, c))) / 6.0


def merged(triangles: Floats) -> Triangles:
    """Return triangles (m, 3, 3) [mm] with equal corners as one, in the order in which they first occur."""
    corners = triangles.reshape(-1, 3)
    places = np.round(corners * _MERGED).astype(np.int64)
    _, first, same = np.unique(places, axis=0, return_index=True, return_inverse=True)
    order = np.argsort(first)
    rank = np.empty_like(order)
    rank[order] = np.arange(len(order))
    return Triangles(vertices=corners[first[order]], faces=rank[same.reshape(-1, 3)])
