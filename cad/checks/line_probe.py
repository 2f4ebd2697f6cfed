"""Where a straight line runs inside a solid: exact on a B-rep, by triangles on a mesh."""

from __future__ import annotations

import numpy as np
import trimesh

from cad.files.stl import Floats
from cad.kernel import OCP, cq
from cad.parts.part import NEAR_MM

Vector = tuple[float, float, float]
Spans = tuple[tuple[float, float], ...]


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

    def __init__(self, mesh: trimesh.Trimesh) -> None:
        self._mesh = mesh
        self._before = 2.0 * float(mesh.extents.sum()) + float(np.abs(mesh.bounds).sum())

    def spans(self, start: Vector, direction: Vector) -> Spans:
        """Return the spans [mm along the unit direction] where the endless line through start is inside."""
        unit = np.array(direction)
        origin = np.array(start) - self._before * unit
        hits, _, _ = self._mesh.ray.intersects_location([origin], [unit], multiple_hits=True)
        return _paired(np.sort((hits - np.array(start)) @ unit))


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
