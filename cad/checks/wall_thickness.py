"""Least wall and least gap of a closed mesh: rays from its surface inward and outward to the face opposite."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import trimesh

Points = npt.NDArray[np.float64]
Indices = npt.NDArray[np.int64]
_SAMPLES = 2000
_OPPOSITE = -0.75  # cosine between two faces of one wall; the faces of a 45 degree wedge are no wall
_OFF = 1e-5  # [mm] nearer than this, a ray has met the triangle that it starts from
_EDGE = 1e-9  # so that no ray slips through between two triangles
REACHES_MM = (4.0, 16.0)  # far more than any wall or gap that matters
_CHUNK = 250
_PLASTIC = 1.3247179572447460  # steps of the R2 sequence, M. Roberts, 2018: even cover without chance


@dataclass(frozen=True, kw_only=True)
class Span:
    """The shortest distance [mm] between two faces that look at each other, and where it starts."""

    length: float
    place: tuple[float, float, float]


def least_wall(mesh: trimesh.Trimesh) -> Span | None:
    """Return the thinnest wall, or None where no two faces within 16 mm are opposite each other."""
    return _least(mesh, -1.0)


def least_gap(mesh: trimesh.Trimesh) -> Span | None:
    """Return the narrowest gap between two faces of the mesh, or None where there is none within 16 mm."""
    return _least(mesh, 1.0)


def _least(mesh: trimesh.Trimesh, sense: float) -> Span | None:
    """Return the shortest span along the normals; rays reach farther only where none of the shorter met a face."""
    starts, faces = surface_points(mesh)
    normals = np.asarray(mesh.face_normals)[faces]
    for reach in REACHES_MM:
        lengths, targets = _first_hits(mesh, starts, sense * normals, reach)
        met = np.flatnonzero(np.isfinite(lengths))
        facing = np.einsum("ij,ij->i", normals[met], np.asarray(mesh.face_normals)[targets[met]]) < _OPPOSITE
        if facing.any():
            shortest = met[facing][np.argmin(lengths[met][facing])]
            x, y, z = (float(value) for value in starts[shortest])
            return Span(length=float(lengths[shortest]), place=(x, y, z))
    return None


def _first_hits(mesh: trimesh.Trimesh, starts: Points, rays: Points, reach: float) -> tuple[Points, Indices]:
    """Return by ray the distance [mm] to the first triangle it meets within a reach, else infinity, and which it is."""
    lengths, targets = np.full(len(starts), np.inf), np.zeros(len(starts), dtype=np.int64)
    for first in range(0, len(starts), _CHUNK):
        rows = slice(first, first + _CHUNK)
        near, far = starts[rows], starts[rows] + reach * rays[rows]
        found, counts = mesh.triangles_tree.intersection_v(np.minimum(near, far), np.maximum(near, far))
        source = np.repeat(np.arange(len(near)), np.asarray(counts, dtype=np.int64))
        found = np.asarray(found, dtype=np.int64)
        t = _distances(near[source], rays[rows][source], np.asarray(mesh.triangles)[found])
        order = np.lexsort((t, source))
        ray, at = np.unique(source[order], return_index=True)
        lengths[first + ray], targets[first + ray] = t[order][at], found[order][at]
    lengths[lengths > reach] = np.inf
    return lengths, targets


def _distances(starts: Points, rays: Points, triangles: Points) -> Points:
    """Return the distance along each ray to its triangle, infinity where it misses.

    T. Moller, B. Trumbore, Fast, minimum storage ray-triangle intersection, J. Graphics Tools 2, 1997.
    """
    a, b, c = triangles.transpose(1, 0, 2)
    across = np.cross(rays, c - a)
    det = np.einsum("ij,ij->i", b - a, across)
    safe = np.where(det == 0.0, 1.0, det)
    u = np.einsum("ij,ij->i", starts - a, across) / safe
    along = np.cross(starts - a, b - a)
    v = np.einsum("ij,ij->i", rays, along) / safe
    t = np.einsum("ij,ij->i", c - a, along) / safe
    hit = (det != 0.0) & (u >= -_EDGE) & (v >= -_EDGE) & (u + v <= 1.0 + _EDGE) & (t > _OFF)
    return np.where(hit, t, np.inf)


def surface_points(mesh: trimesh.Trimesh) -> tuple[Points, Indices]:
    """Return points [mm] spread evenly over the surface, one at least on every plane face, and their triangles."""
    areas = np.asarray(mesh.area_faces)
    steps = (np.arange(_SAMPLES) + 0.5) / _SAMPLES * areas.sum()
    even = np.searchsorted(np.cumsum(areas), steps).clip(max=len(areas) - 1)
    planes = [facet[np.argmax(areas[facet])] for facet in mesh.facets]
    faces = np.concatenate([even, np.array(planes, dtype=np.int64)])
    count = np.arange(1, len(faces) + 1)
    u, v = (count / _PLASTIC) % 1.0, (count / _PLASTIC**2) % 1.0
    u[_SAMPLES:] = v[_SAMPLES:] = 1.0 / 3.0
    over = u + v > 1.0
    u[over], v[over] = 1.0 - u[over], 1.0 - v[over]
    a, b, c = np.asarray(mesh.triangles)[faces].transpose(1, 0, 2)
    return a + u[:, None] * (b - a) + v[:, None] * (c - a), faces
