"""Views of a solid: its visible edges, seen from one side.

The CAD kernel removes hidden lines. A view lies in the plane z = 0, with x to the right and y up.
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
# Directions towards the eye and to the right of the view, for a sensor whose tips lie along x and whose front is at -y.
_EYES: dict[Side, tuple[gp_Dir, gp_Dir]] = {
    "left": (gp_Dir(-1.0, 0.0, 0.0), gp_Dir(0.0, -1.0, 0.0)),
    "behind": (gp_Dir(0.0, 1.0, 0.0), gp_Dir(-1.0, 0.0, 0.0)),
    # From the right, in front and above: 60 degrees from the front direction, 25 degrees above the horizontal.
    "corner": (gp_Dir(0.7849, -0.4532, 0.4226), gp_Dir(0.5, 0.8660, 0.0)),
}
_FULL_DEG = 360.0
_STEPS = 24  # number of straight segments that replace a curved edge
_SAME_MM = 1e-3  # an edge is straight if its length exceeds its chord by less than the square of this value


def view_of(shape: cq.Shape, side: Side) -> list[cq.Edge]:
    """Return the visible edges of a solid seen from a side [mm], in the plane z = 0."""
    hidden_line_removal = HLRBRep_Algo()
    hidden_line_removal.Add(shape.wrapped)
    hidden_line_removal.Projector(HLRAlgo_Projector(_frame(side)))
    hidden_line_removal.Update()
    hidden_line_removal.Hide()
    projected = HLRBRep_HLRToShape(hidden_line_removal)
    edges: list[cq.Edge] = []
    # Sharp edges, and the silhouettes of curved faces.
    for compound in (projected.VCompound(), projected.OutLineVCompound()):
        if compound and not compound.IsNull():  # OCCT returns null instead of an empty compound
            BRepLib.BuildCurves3d_s(compound)
            edges += cq.Shape(compound).Edges()
    return edges


def _frame(side: Side) -> gp_Ax2:
    """Return the coordinate system of a view: z points towards the eye, x to the right."""
    to_eye, right = _EYES[side]
    return gp_Ax2(gp_Pnt(0.0, 0.0, 0.0), to_eye, right)


def point_in_view(point: cq.Vector, side: Side) -> Point:
    """Return the coordinates of a point in the view from a side [mm]."""
    frame = _frame(side)
    x, y = (point.dot(cq.Vector(axis)) for axis in (frame.XDirection(), frame.YDirection()))
    return x, y


def draw_view(canvas: Canvas, edges: Sequence[cq.Edge], origin: Point) -> None:
    """Draw a view; `origin` [mm] is the point of the drawing at which the origin of the solid is placed."""
    draw_edges(canvas, [edge.translate(cq.Vector(*origin, 0.0)) for edge in edges])


def draw_edges(canvas: Canvas, edges: Sequence[cq.Edge], layer: str = "PART") -> None:
    """Draw edges in the plane z = 0; curves other than circles and arcs become straight segments."""
    for edge in edges:
        points = edge_points(edge)
        if edge.geomType() != "CIRCLE":
            canvas.polyline(points, layer)
            continue
        centre = edge.arcCenter()
        if edge.IsClosed():
            canvas.circle((centre.x, centre.y), edge.radius(), layer)
            continue
        first, middle, last = (_angle(centre, edge.positionAt(share)) for share in (0.0, 0.5, 1.0))
        if (middle - first) % _FULL_DEG > (last - first) % _FULL_DEG:  # the edge runs clockwise
            first, last = last, first
        canvas.arc((centre.x, centre.y), edge.radius(), first, last, layer)


def edge_points(edge: cq.Edge) -> list[Point]:
    """Return points along an edge [mm]; for a straight edge only its ends."""
    positions = [edge.positionAt(step / _STEPS) for step in range(_STEPS + 1)]
    points = [(position.x, position.y) for position in positions]
    chord = math.dist(points[0], points[-1])
    length = sum(math.dist(points[step], points[step + 1]) for step in range(_STEPS))
    return [points[0], points[-1]] if length < chord + _SAME_MM**2 else points


def _angle(centre: cq.Vector, point: cq.Vector) -> float:
    """Return the direction from a centre to a point, counter-clockwise from x in 0 to 360 [deg]."""
    return math.degrees(math.atan2(point.y - centre.y, point.x - centre.x)) % _FULL_DEG
