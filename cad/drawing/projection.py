"""Views of a solid: its visible edges, as seen from one side.

The CAD kernel removes the hidden lines. A view lies in the plane z = 0, with x to the right and y up.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Literal

import cadquery as cq
from OCP.BRepLib import BRepLib
from OCP.gp import gp_Ax2, gp_Dir, gp_Pnt
from OCP.HLRAlgo import HLRAlgo_Projector
from OCP.HLRBRep import HLRBRep_Algo, HLRBRep_HLRToShape

from cad.drawing.canvas import Canvas, Point

Side = Literal["left", "behind", "corner"]
# The directions towards the viewer and to the right of the view. The tips of a sensor lie along x; its front is at -y.
_DIRECTIONS: dict[Side, tuple[gp_Dir, gp_Dir]] = {
    "left": (gp_Dir(-1.0, 0.0, 0.0), gp_Dir(0.0, -1.0, 0.0)),
    "behind": (gp_Dir(0.0, 1.0, 0.0), gp_Dir(-1.0, 0.0, 0.0)),
    # From the right, in front and above: 60 degrees from the front direction, 25 degrees above the horizontal.
    "corner": (gp_Dir(0.7849, -0.4532, 0.4226), gp_Dir(0.5, 0.8660, 0.0)),
}
_FULL_DEG = 360.0
_SEGMENTS = 24  # number of straight segments that replace a curved edge
_STRAIGHT_MM = 1e-6  # an edge is straight if its length exceeds its chord by less than this


def project_visible_edges(shape: cq.Shape, side: Side) -> list[cq.Edge]:
    """Return the visible edges of a solid as seen from a side [mm], projected onto the plane z = 0.

    The visible edges are the sharp edges of the solid and the silhouettes of its curved faces.
    """
    hidden_line_removal = HLRBRep_Algo()
    hidden_line_removal.Add(shape.wrapped)
    hidden_line_removal.Projector(HLRAlgo_Projector(_frame(side)))
    hidden_line_removal.Update()
    hidden_line_removal.Hide()
    projected = HLRBRep_HLRToShape(hidden_line_removal)
    edges: list[cq.Edge] = []
    sharp_edges, silhouettes = projected.VCompound(), projected.OutLineVCompound()
    for compound in (sharp_edges, silhouettes):
        if compound and not compound.IsNull():  # OCCT returns null instead of an empty compound
            BRepLib.BuildCurves3d_s(compound)  # the projected edges have only 2-D curves
            edges += cq.Shape(compound).Edges()
    return edges


def _frame(side: Side) -> gp_Ax2:
    """Return the coordinate system of a view: z points towards the viewer, and x points to the right."""
    towards_viewer, right = _DIRECTIONS[side]
    return gp_Ax2(gp_Pnt(0.0, 0.0, 0.0), towards_viewer, right)


def point_in_view(point: cq.Vector, side: Side) -> Point:
    """Return the coordinates [mm] that a point of the solid has in the view from a side."""
    frame = _frame(side)
    x, y = (point.dot(cq.Vector(axis)) for axis in (frame.XDirection(), frame.YDirection()))
    return x, y


def draw_view(canvas: Canvas, edges: Sequence[cq.Edge], origin: Point) -> None:
    """Draw the edges of a view; the origin of the solid is placed at the point `origin` [mm] of the drawing."""
    draw_edges(canvas, [edge.translate(cq.Vector(*origin, 0.0)) for edge in edges])


def draw_edges(canvas: Canvas, edges: Sequence[cq.Edge], layer: str = "PART") -> None:
    """Draw edges that lie in the plane z = 0 [mm].

    Circles and circular arcs are kept. Any other curve is replaced by straight segments.
    """
    for edge in edges:
        points = edge_points(edge)
        if edge.geomType() != "CIRCLE":
            canvas.polyline(points, layer)
            continue
        centre = edge.arcCenter()
        if edge.IsClosed():
            canvas.circle((centre.x, centre.y), edge.radius(), layer)
            continue
        first, middle, last = (_angle(centre, edge.positionAt(fraction)) for fraction in (0.0, 0.5, 1.0))
        # Canvas arcs run counter-clockwise. On such an arc, the middle comes before the last point. Otherwise the edge
        # runs clockwise, and its ends are exchanged.
        if (middle - first) % _FULL_DEG > (last - first) % _FULL_DEG:
            first, last = last, first
        canvas.arc((centre.x, centre.y), edge.radius(), first, last, layer)


def edge_points(edge: cq.Edge) -> list[Point]:
    """Return points along an edge [mm]; for a straight edge, only its two ends are returned."""
    positions = [edge.positionAt(step / _SEGMENTS) for step in range(_SEGMENTS + 1)]
    points = [(position.x, position.y) for position in positions]
    chord = math.dist(points[0], points[-1])
    length = sum(math.dist(points[step], points[step + 1]) for step in range(_SEGMENTS))
    return [points[0], points[-1]] if length < chord + _STRAIGHT_MM else points


def _angle(centre: cq.Vector, point: cq.Vector) -> float:
    """Return the direction from a centre to a point [deg]: from 0 to 360, counter-clockwise from the x axis."""
    return math.degrees(math.atan2(point.y - centre.y, point.x - centre.x)) % _FULL_DEG
