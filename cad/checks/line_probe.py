"""Where a straight line runs inside a solid: exact on a B-rep, by triangles on a mesh."""

from __future__ import annotations

import cadquery as cq
import numpy as np
import OCP

from cad.parts.part import NEAR_MM
from cad.triangles import Floats, Triangles

Vector = tuple[float, float, float]
Spans = tuple[tuple[float, float], ...]
_OFF = 1e-5  # [mm] nearer than this, a ray has met the triangle that it starts from
_EDGE = 1e-9  # so that no ray slips through between two triangles


class SolidLines:
    """Spans of lines inside a B-rep solid [mm]."""

    def __init__(self, shape: cq.Shape) -> None:
        self._faces = OCP.IntCurvesFace.IntCurvesFace_ShapeIntersector()
        self._faces.Load(shape.wrapped, 1e-7)

    def spans(self, start: Vector, direction: Vector) -> Spans:
        """Return the spans [mm along the unit direction] where the endless line through start is inside."""
        line = OCP.gp.gp_Lin(OCP.gp.gp_Pnt(*start), OCP.gp.gp_Dir(*direction))
        self._faces.Perform(line, -1e6, 1e6)
        return _paired(np.sort([self._faces.WParameter(i + 1) for i in range(self._faces.NbPnt())]))


class MeshLines:
    """Spans of lines inside a closed mesh of triangles [mm]."""

    def __init__(self, mesh: Triangles) -> None:
        self._triangles, self._vertices = mesh.triangles, mesh.vertices
        self._corners = np.ascontiguousarray(mesh.faces.T)
        least, most = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
        self._before = 2.0 * float((most - least).sum()) + float(np.abs([least, most]).sum())

    def spans(self, start: Vector, direction: Vector) -> Spans:
        """Return the spans [mm along the unit direction] where the endless line through start is inside."""
        unit = np.array(direction)
        origin = np.array(start) - self._before * unit
        near = self._near(np.array(start), unit)
        met = near[np.isfinite(ray_distances(origin[None], unit[None], near))]
        normals = np.cross(met[:, 1] - met[:, 0], met[:, 2] - met[:, 1])
        normals *= (1.0 / np.sqrt((normals * normals) @ np.ones(3)))[:, None]
        distances = (((met[:, 0] - origin) * normals) @ np.ones(3)) / ((unit * normals) @ np.ones(3))
        hits = unit * distances[:, None] + origin
        return _paired(np.sort((hits - np.array(start)) @ unit))

    def _near(self, start: Floats, unit: Floats) -> Floats:
        """Return the triangles whose boxes, seen along a line, hold it."""
        holding = np.ones(len(self._triangles), dtype=bool)
        for across in np.linalg.svd(unit[None])[2][1:]:
            beside = ((self._vertices - start) @ across)[self._corners]
            holding &= (beside.min(axis=0) <= NEAR_MM) & (beside.max(axis=0) >= -NEAR_MM)
        return np.asarray(self._triangles[holding])


Lines = SolidLines | MeshLines


def _paired(crossings: Floats) -> Spans:
    """Return spans from sorted crossings, each pair an entry and an exit; an odd count has no spans.

    Two crossings very near each other are one edge that two faces share.
    """
    if len(crossings) == 0:
        return ()
    apart = np.concatenate([[True], np.diff(crossings) > NEAR_MM])
    single = crossings[apart]
    if len(single) % 2:
        return ()
    return tuple((float(a), float(b)) for a, b in single.reshape(-1, 2))


def ray_distances(starts: Floats, rays: Floats, triangles: Floats) -> Floats:
    """Return the distance along each ray to its triangle [mm], infinity where it misses.

    T. Moller, B. Trumbore, Fast, minimum storage ray-triangle intersection, J. Graphics Tools 2, 1997.
    """
    a, b, c = triangles.transpose(1, 0, 2)
    across, along = np.cross(rays, c - a), np.cross(starts - a, b - a)
    det = np.einsum("ij,ij->i", b - a, across)
    divisor = np.where(det == 0.0, 1.0, det)
    u = np.einsum("ij,ij->i", starts - a, across) / divisor
    v = np.einsum("ij,ij->i", rays, along) / divisor
    t = np.einsum("ij,ij->i", c - a, along) / divisor
    inside = (u >= -_EDGE) & (v >= -_EDGE) & (u + v <= 1.0 + _EDGE)
    return np.where((det != 0.0) & inside & (t > _OFF), t, np.inf)
