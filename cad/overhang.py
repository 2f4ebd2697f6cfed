"""Faces that a process would have to print on air."""

import numpy as np
import shapely
import trimesh

REACH_MM = 1.0  # a ledge up to this wide needs no support: Formlabs, design guide, unsupported overhangs
_BED_MM = 0.05
_SPREAD_DEG = 0.5  # a facet of a round or 45 degree face is this much off
POSES = {
    "as it stands": (0.0, 0.0, 1.0), "upside down": (0.0, 0.0, -1.0), "+x up": (1.0, 0.0, 0.0),
    "-x up": (-1.0, 0.0, 0.0), "+y up": (0.0, 1.0, 0.0), "-y up": (0.0, -1.0, 0.0),
}  # fmt: skip


def widest_ledge(mesh: trimesh.Trimesh, up: tuple[float, float, float], limit_deg: float) -> float:
    """Return the width [mm] of the widest patch of faces that hang over more than the limit [deg from the vertical].

    The width of a patch is the short side of the smallest rectangle around it, seen from above. Faces on the
    print bed carry themselves.
    """
    turn = np.asarray(trimesh.geometry.align_vectors(up, (0.0, 0.0, 1.0)))[:3, :3]
    triangles, normals = np.asarray(mesh.triangles) @ turn.T, np.asarray(mesh.face_normals) @ turn.T
    height = triangles[:, :, 2].max(axis=1) - triangles[:, :, 2].min()
    steep = -normals[:, 2] > np.sin(np.radians(min(limit_deg + _SPREAD_DEG, 90.0)))
    hanging = np.flatnonzero(steep & (height > _BED_MM))
    if len(hanging) == 0:
        return 0.0
    patches = trimesh.graph.connected_components(
        _both_in(np.asarray(mesh.face_adjacency), steep & (height > _BED_MM)), nodes=hanging
    )
    return max(_width(triangles[patch][:, :, :2]) for patch in patches)


def _both_in(pairs: np.ndarray, chosen: np.ndarray) -> np.ndarray:  # type: ignore[type-arg]
    return pairs[chosen[pairs].all(axis=1)]


def _width(triangles: np.ndarray) -> float:  # type: ignore[type-arg]
    """Return the short side of the smallest rectangle around the corners [mm]."""
    around = shapely.MultiPoint(triangles.reshape(-1, 2)).minimum_rotated_rectangle
    if not isinstance(around, shapely.Polygon):
        return 0.0
    corners = np.array(around.exterior.coords)
    sides = np.linalg.norm(np.diff(corners, axis=0), axis=1)
    return float(min(sides[0], sides[1]))
