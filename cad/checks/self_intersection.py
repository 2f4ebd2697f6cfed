"""Triangles of a mesh that pass through each other."""

from collections.abc import Iterator

import numpy as np
import numpy.typing as npt
import trimesh

Array = npt.NDArray[np.float64]
_CHUNK = 256
_FLAT = 1e-9  # a crossing nearer to an edge than this share of the volume spanned is a touch


def crossing_pairs(mesh: trimesh.Trimesh) -> npt.NDArray[np.int64]:
    """Return the pairs of triangles without a common corner of which an edge of one passes through the other (n, 2)."""
    triangles, faces = np.asarray(mesh.triangles), np.asarray(mesh.faces)
    found = [pairs[_cross(triangles, pairs) | _cross(triangles, pairs[:, ::-1])] for pairs in _near(triangles, faces)]
    return np.concatenate(found) if found else np.empty((0, 2), dtype=np.int64)


def _near(triangles: Array, faces: npt.NDArray[np.int64]) -> Iterator[npt.NDArray[np.int64]]:
    """Yield pairs of triangles whose boxes overlap and which share no corner."""
    low, high = triangles.min(axis=1), triangles.max(axis=1)
    order = np.argsort(low[:, 0], kind="stable")
    low, high, corners = low[order], high[order], faces[order]
    for start in range(0, len(order), _CHUNK):
        rows = np.arange(start, min(start + _CHUNK, len(order)))
        end = int(np.searchsorted(low[:, 0], high[rows, 0].max(), side="right"))
        columns = np.arange(start, end)
        over = np.ones((len(rows), len(columns)), dtype=bool)
        for axis in range(3):
            over &= low[rows, axis, None] <= high[None, columns, axis]
            over &= low[None, columns, axis] <= high[rows, axis, None]
        first, second = np.nonzero(over)
        a, b = rows[first], columns[second]
        a, b = a[a < b], b[a < b]
        apart = ~(corners[a][:, :, None] == corners[b][:, None, :]).any(axis=(1, 2))
        yield np.stack([order[a[apart]], order[b[apart]]], axis=1)


def _cross(triangles: Array, pairs: npt.NDArray[np.int64]) -> npt.NDArray[np.bool_]:
    """Say of each pair whether an edge of the first passes through the second, by signs of spanned volumes."""
    first, (a, b, c) = triangles[pairs[:, 0]], triangles[pairs[:, 1]].transpose(1, 0, 2)
    crossed = np.zeros(len(pairs), dtype=bool)
    for i in range(3):
        p, q = first[:, i], first[:, (i + 1) % 3]
        above, below = _volume(p, a, b, c), _volume(q, a, b, c)
        sides = np.stack([_volume(p, q, a, b), _volume(p, q, b, c), _volume(p, q, c, a)])
        least = _FLAT * (np.abs(above) + np.abs(below) + np.abs(sides).sum(axis=0))
        passes = (sides > least).all(axis=0) | (sides < -least).all(axis=0)
        crossed |= passes & (above * below < 0.0) & (np.minimum(np.abs(above), np.abs(below)) > least)
    return crossed


def _volume(a: Array, b: Array, c: Array, d: Array) -> Array:
    """Return six times the signed volume that four points span [mm^3]."""
    return np.asarray(np.einsum("ij,ij->i", b - a, np.cross(c - a, d - a)))
