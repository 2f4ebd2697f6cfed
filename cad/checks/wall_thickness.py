"""Least wall and least gap of a closed mesh: rays from its surface inward and outward to the face opposite."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import trimesh

from cad.checks.line_probe import ray_distances
from cad.triangles import Floats, Indices

_SAMPLES = 2000
_OPPOSITE = -0.75  # cosine between two faces of one wall; the faces of a 45 degree wedge are no wall
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
    face_normals = np.asarray(mesh.face_normals)
    normals = face_normals[faces]
    for reach in REACHES_MM:
        lengths, targets = _first_hits(mesh, starts, sense * normals, reach)
        hits = np.flatnonzero(np.isfinite(lengths))
        facing = hits[np.einsum("ij,ij->i", normals[hits], face_normals[targets[hits]]) < _OPPOSITE]
        if len(facing):
            shortest = facing[np.argmin(lengths[facing])]
            x, y, z = (float(value) for value in starts[shortest])
            return Span(length=float(lengths[shortest]), place=(x, y, z))
    return None


def _first_hits(mesh: trimesh.Trimesh, starts: Floats, rays: Floats, reach: float) -> tuple[Floats, Indices]:
    """Return by ray the distance [mm] to the first triangle it meets within a reach, else infinity, and which it is."""
    lengths, targets = np.full(len(starts), np.inf), np.zeros(len(starts), dtype=np.int64)
    triangles, ends = np.asarray(mesh.triangles), starts + reach * rays
    for rows in np.array_split(np.arange(len(starts)), math.ceil(len(starts) / _CHUNK)):
        near, counts = _triangles_near(mesh, starts[rows], ends[rows])
        source = np.repeat(rows, counts)
        distances = ray_distances(starts[source], rays[source], triangles[near])
        np.minimum.at(lengths, source, distances)
        nearest = np.flatnonzero(distances == lengths[source])[::-1]  # of equally near ones the first
        targets[source[nearest]] = near[nearest]
    lengths[lengths > reach] = np.inf
    return lengths, targets


def _triangles_near(mesh: trimesh.Trimesh, starts: Floats, ends: Floats) -> tuple[Indices, Indices]:
    """Return the triangles whose boxes meet those of segments, segment by segment, and how many each has."""
    near, counts = mesh.triangles_tree.intersection_v(np.minimum(starts, ends), np.maximum(starts, ends))
    return near.astype(np.int64), counts.astype(np.int64)


def surface_points(mesh: trimesh.Trimesh) -> tuple[Floats, Indices]:
    """Return points [mm] spread evenly over the surface, one at least on every plane face, and their triangles."""
    areas = np.asarray(mesh.area_faces)
    steps = (np.arange(_SAMPLES) + 0.5) / _SAMPLES * areas.sum()
    even = np.searchsorted(np.cumsum(areas), steps).clip(max=len(areas) - 1)
    planes = [facet[np.argmax(areas[facet])] for facet in mesh.facets]
    faces = np.concatenate([even, np.array(planes, dtype=np.int64)])
    u, v = _shares(len(faces))[:, :, None]
    a, b, c = np.asarray(mesh.triangles)[faces].transpose(1, 0, 2)
    return a + u * (b - a) + v * (c - a), faces


def _shares(count: int) -> Floats:
    """Return for each point its shares of two sides of its triangle, shape (2, count): evenly, then in the middle."""
    shares = np.arange(1, count + 1) / np.array([[_PLASTIC], [_PLASTIC**2]]) % 1.0
    shares[:, _SAMPLES:] = 1.0 / 3.0
    return np.asarray(np.where(shares.sum(axis=0) > 1.0, 1.0 - shares, shares))
