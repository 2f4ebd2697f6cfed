"""The spans of a straight line inside a part: exact on a B-rep, by triangles on a mesh."""

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
_EDGE = 1e-9  # barycentric tolerance, so that a line through a shared edge meets both triangles


class Chord(NamedTuple):
    """The span of a line inside the material, from entry to exit [mm along the line]."""

    enter: float
    leave: float


Lines = Callable[[Vector, Vector], tuple[Chord, ...]]
"""A function of a start [mm] and a unit direction that returns the spans of this infinite line inside a part."""


def solid_lines(shape: cq.Shape) -> Lines:
    """Return the function that measures lines through a B-rep solid [mm]."""
    faces = OCP.IntCurvesFace.IntCurvesFace_ShapeIntersector()
    faces.Load(shape.wrapped, 1e-7)

    def spans(start: Vector, direction: Vector) -> tuple[Chord, ...]:
        line = OCP.gp.gp_Lin(OCP.gp.gp_Pnt(*start), OCP.gp.gp_Dir(*direction))
        faces.Perform(line, -1e6, 1e6)
        return _paired(np.array([faces.WParameter(i + 1) for i in range(faces.NbPnt())]))

    return spans


def mesh_lines(mesh: trimesh.Trimesh) -> Lines:
    """Return the function that measures lines through a closed mesh of triangles [mm].

    The method is T. Moller, B. Trumbore, J. Graphics Tools 2 (1997) 21.
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
        with np.errstate(divide="ignore", invalid="ignore"):  # triangles parallel to the line
            u = np.einsum("ij,ij->i", from_corner, across) / volume
            along = np.cross(from_corner, first)
            v = along @ unit / volume
            crossings = np.einsum("ij,ij->i", second, along) / volume
            is_met = (u >= -_EDGE) & (v >= -_EDGE) & (u + v <= 1.0 + _EDGE) & np.isfinite(crossings)
        return _paired(crossings[is_met])

    return spans


def _paired(crossings: Floats) -> tuple[Chord, ...]:
    """Return the spans between crossings [mm], which alternate between entry and exit; none for an odd count.

    Crossings within `NEAR_MM` are merged, because a line through a shared edge crosses two faces at one point.
    """
    ordered = np.sort(crossings)
    is_new = np.diff(ordered, prepend=-np.inf) > NEAR_MM
    single = ordered[is_new]
    if len(single) % 2:
        return ()
    return tuple(Chord(float(enter), float(leave)) for enter, leave in single.reshape(-1, 2))
