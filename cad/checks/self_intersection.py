"""Triangles of a mesh that pass through each other."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import numpy.typing as npt
import trimesh

from cad.triangles import Floats, Indices

_CHUNK = 4096
_FLAT = 1e-9  # a crossing nearer to an edge than this share of the volume spanned is a touch


def crossing_pairs(mesh: trimesh.Trimesh) -> Indices:
    """Return the pairs of triangles without a common corner of which an edge of one passes through the other.

    Shape (n, 2), in order of the triangles' least x.
    """
    triangles = np.asarray(mesh.triangles)
    crossing = [pairs[_cross(triangles, pairs) | _cross(triangles, pairs[:, ::-1])] for pairs in _near(mesh)]
    return np.concatenate([np.empty((0, 2), dtype=np.int64), *crossing])


def _near(mesh: trimesh.Trimesh) -> Iterator[Indices]:
    """Yield pairs of triangles whose boxes overlap and which share no corner."""
    least, most = np.asarray(mesh.triangles).min(axis=1), np.asarray(mesh.triangles).max(axis=1)
    order = np.argsort(least[:, 0], kind="stable")
    rank = np.argsort(order)
    for start in range(0, len(order), _CHUNK):
        rows = order[start : start + _CHUNK]
        near, counts = mesh.triangles_tree.intersection_v(least[rows], most[rows])
        pairs = np.stack([np.repeat(rows, counts.astype(np.int64)), near.astype(np.int64)], axis=1)
        first, second = rank[pairs].T
        pairs = _apart(np.asarray(mesh.faces), pairs[first < second])
        yield pairs[np.lexsort(rank[pairs].T[::-1])]


def _apart(faces: Indices, pairs: Indices) -> Indices:
    """Return the pairs of triangles that share no corner."""
    a, b = faces[pairs].transpose(1, 0, 2)
    shared: npt.NDArray[np.bool_] = (a[:, :, None] == b[:, None, :]).any(axis=(1, 2))
    return pairs[~shared]


def _cross(triangles: Floats, pairs: Indices) -> npt.NDArray[np.bool_]:
    """Say of each pair whether an edge of the first passes through the second, by signs of spanned volumes."""
    first, (a, b, c) = triangles[pairs[:, 0]], triangles[pairs[:, 1]].transpose(1, 0, 2)
    crossed = np.zeros(len(pairs), dtype=bool)
    for i in range(3):
        crossed |= _pierces(first[:, i], first[:, (i + 1) % 3], (a, b, c))
    return crossed


def _pierces(p: Floats, q: Floats, corners: tuple[Floats, Floats, Floats]) -> npt.NDArray[np.bool_]:
    """Say of each edge p to q whether it passes through the triangle of the corners, each of shape (n, 3)."""
    a, b, c = corners
    above, below = _volume(p, a, b, c), _volume(q, a, b, c)
    sides = np.stack([_volume(p, q, a, b), _volume(p, q, b, c), _volume(p, q, c, a)])
    least = _FLAT * (np.abs(above) + np.abs(below) + np.abs(sides).sum(axis=0))
    inside = (sides > least).all(axis=0) | (sides < -least).all(axis=0)
    through = (above * below < 0.0) & (np.minimum(np.abs(above), np.abs(below)) > least)
    return np.asarray(inside & through)


def _volume(a: Floats, b: Floats, c: Floats, d: Floats) -> Floats:
    """Return six times the signed volume that four points span [mm^3]."""
    return np.asarray(np.einsum("ij,ij->i", b - a, np.cross(c - a, d - a)))
