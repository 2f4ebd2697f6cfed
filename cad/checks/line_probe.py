"""Where a straight line runs inside a solid: exact on a B-rep, by triangles on a mesh."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import cadquery as cq
import numpy as np
import OCP
import trimesh

from cad.parts.part import NEAR_MM
from sensor.arrays import Floats

Vector = tuple[float, float, float]
UP: Vector = (0.0, 0.0, 1.0)
_EDGE = 1e-9  # of a triangle: a line that passes by no more than this meets its edge


class Chord(NamedTuple):
    """Where a line enters the material and where it leaves it [mm along the line]."""

    enter: float
    leave: float


# The spans [mm along the unit direction] where the endless line through a start is inside a form of a part.
Lines = Callable[[Vector, Vector], tuple[Chord, ...]]


def solid_lines(shape: cq.Shape) -> Lines:
    """Return the spans of lines inside a B-rep solid [mm]."""
    faces = OCP.IntCurvesFace.IntCurvesFace_ShapeIntersector()
    faces.Load(shape.wrapped, 1e-7)

    def spans(start: Vector, direction: Vector) -> tuple[Chord, ...]:
        line = OCP.gp.gp_Lin(OCP.gp.gp_Pnt(*start), OCP.gp.gp_Dir(*direction))
        faces.Perform(line, -1e6, 1e6)
        return _paired(np.array([faces.WParameter(i + 1) for i in range(faces.NbPnt())]))

    return spans


def mesh_lines(mesh: trimesh.Trimesh) -> Lines:
    """Return the spans of lines inside a closed mesh of triangles [mm].

    T. Moller, B. Trumbore, J. Graphics Tools 2 (1997) 21; a line through an edge meets both of its triangles.
    """
    corners = np.asarray(mesh.triangles)
    corner = corners[:, 0]
    first = corners[:, 1] - corner
    second = corners[:, 2] - corner

    def spans(start: Vector, direction: Vector) -> tuple[Chord, ...]:
        unit = np.array(direction)
        from_corner = np.array(start) - corner
        across = np.cross(unit, second)
        volume = np.einsum("ij,ij->i", first, across)
        with np.errstate(divide="ignore", invalid="ignore"):  # of triangles along the line
            u = np.einsum("ij,ij->i", from_corner, across) / volume
            along = np.cross(from_corner, first)
            v = along @ unit / volume
            crossings = np.einsum("ij,ij->i", second, along) / volume
            is_met = (u >= -_EDGE) & (v >= -_EDGE) & (u + v <= 1.0 + _EDGE) & np.isfinite(crossings)
        return _paired(crossings[is_met])

    return spans


def _paired(crossings: Floats) -> tuple[Chord, ...]:
    """Return spans from crossings, each pair an entry and an exit; an odd count has no spans.

    Two crossings very near each other are one edge that two faces share.
    """
    ordered = np.sort(crossings)
    is_new = np.diff(ordered, prepend=-np.inf) > NEAR_MM
    single = ordered[is_new]
    if len(single) % 2:
        return ()
    return tuple(Chord(float(enter), float(leave)) for enter, leave in single.reshape(-1, 2))
