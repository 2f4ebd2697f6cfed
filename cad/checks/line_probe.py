"""The chords of a straight line through a part: the intervals in which the line is inside the material.

For a B-rep solid the chords are exact; for a mesh they are computed from its triangles.
"""

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
_EDGE_TOLERANCE = 1e-9  # added to barycentric coordinates, so that a line through a shared edge hits both triangles
_KERNEL_TOLERANCE_MM = 1e-7  # tolerance of the CAD kernel for the crossing of a line and a face
_REACH_MM = 1e6  # length of a line on either side of its given point, far longer than any part


class Chord(NamedTuple):
    """An interval of a line inside the material, from entry to exit [mm along the line]."""

    enter: float
    leave: float


LineProbe = Callable[[Vector, Vector], tuple[Chord, ...]]
"""A function that returns the chords of an infinite line in a part.

The line is given by a point [mm] and a unit direction. Positions on the line are measured from the point.
"""


def solid_probe(shape: cq.Shape) -> LineProbe:
    """Return a function that measures the chords [mm] of lines in a B-rep solid."""
    intersector = OCP.IntCurvesFace.IntCurvesFace_ShapeIntersector()
    intersector.Load(shape.wrapped, _KERNEL_TOLERANCE_MM)

    def measure_chords(start: Vector, direction: Vector) -> tuple[Chord, ...]:
        """Return the chords [mm] of the line through `start` [mm] along the unit vector `direction`."""
        line = OCP.gp.gp_Lin(OCP.gp.gp_Pnt(*start), OCP.gp.gp_Dir(*direction))
        intersector.Perform(line, -_REACH_MM, _REACH_MM)
        return _pair_crossings(np.array(crossings_of(intersector)))

    return measure_chords


def crossings_of(intersector: OCP.IntCurvesFace.IntCurvesFace_ShapeIntersector) -> list[float]:
    """Return the positions [mm] at which the last line of an intersector crosses its shape."""
    return [intersector.WParameter(number + 1) for number in range(intersector.NbPnt())]  # OCCT counts from 1


def mesh_probe(mesh: trimesh.Trimesh) -> LineProbe:
    """Return a function that measures the chords [mm] of lines in a closed triangle mesh.

    The method is from T. Moller and B. Trumbore, J. Graphics Tools 2 (1997) 21. A line runs from the point s in the
    direction d, and a triangle has the corner o and the sides a and b. The line crosses the plane of the triangle at
    s + t d = o + u a + v b. This equation is solved for t, u and v.
    """
    # The corner o and the sides a and b of every triangle, each of shape (triangles, 3).
    corners = np.asarray(mesh.triangles)
    origin = corners[:, 0]
    first_side = corners[:, 1] - origin
    second_side = corners[:, 2] - origin

    def measure_chords(start: Vector, direction: Vector) -> tuple[Chord, ...]:
        """Return the chords [mm] of the line through `start` [mm] along the unit vector `direction`."""
        unit = np.array(direction)
        offset = np.array(start) - origin
        direction_cross_second = np.cross(unit, second_side)
        determinant = np.einsum("ij,ij->i", first_side, direction_cross_second)
        # The determinant is 0 for a triangle parallel to the line. The crossing of such a triangle is not finite, and
        # is dropped.
        with np.errstate(divide="ignore", invalid="ignore"):
            # u and v are the barycentric coordinates of the crossing, and `crossings` is its position t on the line.
            u = np.einsum("ij,ij->i", offset, direction_cross_second) / determinant
            offset_cross_first = np.cross(offset, first_side)
            v = offset_cross_first @ unit / determinant
            crossings = np.einsum("ij,ij->i", second_side, offset_cross_first) / determinant
            # The crossing is inside the triangle if u, v and 1 - u - v are not negative.
            is_hit = (
                (u >= -_EDGE_TOLERANCE)
                & (v >= -_EDGE_TOLERANCE)
                & (u + v <= 1.0 + _EDGE_TOLERANCE)
                & np.isfinite(crossings)
            )
        return _pair_crossings(crossings[is_hit])

    return measure_chords


def _pair_crossings(crossings: Floats) -> tuple[Chord, ...]:
    """Return the chords between the crossings [mm] of a line with a closed surface.

    Crossings alternate between entry and exit. Crossings within `NEAR_MM` are merged, because a line through a shared
    edge crosses two faces at one point. If the number of distinct crossings is odd, they do not form pairs, and no
    chord is returned.
    """
    ordered = np.sort(crossings)
    # The first crossing is always distinct, because the position -inf is put before it.
    is_distinct = np.diff(ordered, prepend=-np.inf) > NEAR_MM
    distinct = ordered[is_distinct]
    if len(distinct) % 2:
        return ()
    return tuple(Chord(float(enter), float(leave)) for enter, leave in distinct.reshape(-1, 2))
