"""Least wall and least gap of a closed mesh: rays from its surface inward and outward to the face opposite."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import trimesh

Points = npt.NDArray[np.float64]
_SAMPLES = 3000
_OPPOSITE = -0.5  # cosine between two faces of one wall; faces of a wedge or an edge are no wall
_OFF = 1e-5  # [mm] a ray starts this far from its own triangle
_PLASTIC = 1.3247179572447460  # steps of the R2 sequence, M. Roberts, 2018: even cover without chance


@dataclass(frozen=True, kw_only=True)
class Span:
    """The shortest distance [mm] between two faces that look at each other, and where it starts."""

    length: float
    place: tuple[float, float, float]


def least_wall(mesh: trimesh.Trimesh) -> Span | None:
    """Return the thinnest wall, or None where no two faces are opposite each other."""
    return _least(mesh, -1.0)


def least_gap(mesh: trimesh.Trimesh) -> Span | None:
    """Return the narrowest gap between two faces of the same mesh, or None where there is none."""
    return _least(mesh, 1.0)


def _least(mesh: trimesh.Trimesh, sense: float) -> Span | None:
    starts, faces = surface_points(mesh)
    normals = np.asarray(mesh.face_normals)[faces]
    rays = sense * normals
    hits, source, target = mesh.ray.intersects_location(starts + _OFF * rays, rays, multiple_hits=False)
    if len(hits) == 0:
        return None
    opposite = np.einsum("ij,ij->i", normals[source], np.asarray(mesh.face_normals)[target]) < _OPPOSITE
    if not opposite.any():
        return None
    lengths = np.where(opposite, np.linalg.norm(hits - starts[source], axis=1), np.inf)
    shortest = int(np.argmin(lengths))
    x, y, z = (float(value) for value in starts[source[shortest]])
    return Span(length=float(lengths[shortest]), place=(x, y, z))


def surface_points(mesh: trimesh.Trimesh) -> tuple[Points, npt.NDArray[np.int64]]:
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
