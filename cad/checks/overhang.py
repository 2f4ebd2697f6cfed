"""Faces that a process would have to print on air."""

from __future__ import annotations

import numpy as np
import shapely
import trimesh

from cad.triangles import Floats

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
    print bed carry themselves. Up is one of the six axes.
    """
    axis = np.array(up)
    level = np.asarray(mesh.triangles) @ axis
    steep = -(np.asarray(mesh.face_normals) @ axis) > np.sin(np.radians(min(limit_deg + _SPREAD_DEG, 90.0)))
    hanging = steep & (level.max(axis=1) - level.min() > _BED_MM)
    if not hanging.any():
        return 0.0
    pairs = np.asarray(mesh.face_adjacency)
    joined = pairs[hanging[pairs].all(axis=1)]
    patches = trimesh.graph.connected_components(joined, nodes=np.flatnonzero(hanging))
    plan = [i for i in range(3) if not axis[i]]
    return max(_width(np.asarray(mesh.triangles)[patch][:, :, plan]) for patch in patches)


def _width(corners: Floats) -> float:
    """Return the short side of the smallest rectangle around corners (n, 3, 2) [mm]."""
    around = shapely.MultiPoint(corners.reshape(-1, 2)).minimum_rotated_rectangle
    if not isinstance(around, shapely.Polygon):
        return 0.0
    sides = np.linalg.norm(np.diff(np.array(around.exterior.coords), axis=0), axis=1)
    return float(min(sides[0], sides[1]))
