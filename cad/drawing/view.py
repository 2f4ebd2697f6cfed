"""What is seen of solids from one side: what lies in front in full lines, what is hidden in dashes.

The kernel removes hidden lines. A view is drawn in the plane z = 0, x to its right and y up.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import cadquery as cq
import shapely
from OCP.BRepLib import BRepLib
from OCP.gp import gp_Ax2, gp_Dir, gp_Pnt
from OCP.HLRAlgo import HLRAlgo_Projector
from OCP.HLRBRep import HLRBRep_Algo, HLRBRep_HLRToShape
from OCP.TopoDS import TopoDS_Shape

from cad.drawing.canvas import Canvas, Point

Side = Literal["front", "left", "above", "corner"]
# Towards the eye, and what is to the right, of a sensor whose tips lie along x and whose front is at -y.
_EYES: dict[Side, tuple[gp_Dir, gp_Dir]] = {
    "front": (gp_Dir(0.0, -1.0, 0.0), gp_Dir(1.0, 0.0, 0.0)),
    "left": (gp_Dir(-1.0, 0.0, 0.0), gp_Dir(0.0, -1.0, 0.0)),
    "above": (gp_Dir(0.0, 0.0, 1.0), gp_Dir(1.0, 0.0, 0.0)),
    "corner": (gp_Dir(-1.0, -1.0, 1.0), gp_Dir(1.0, -1.0, 0.0)),  # isometric, ISO 5456-3
}
_FULL_DEG = 360.0
_STEPS = 24  # straight lines for a curve that is no arc of a circle
_SAME_MM = 1e-3  # lines nearer to each other are one


@dataclass(frozen=True, kw_only=True)
class View:
    """What is seen and what is hidden of one solid: edges in the plane z = 0 [mm]."""

    seen: Sequence[cq.Edge]
    hidden: Sequence[cq.Edge]


def views_of(shapes: Sequence[cq.Shape], side: Side) -> list[View]:
    """Return what is seen of each solid from a side, among the others."""
    towards, right = _EYES[side]
    algorithm = HLRBRep_Algo()
    for shape in shapes:
        algorithm.Add(shape.wrapped)
    algorithm.Projector(HLRAlgo_Projector(gp_Ax2(gp_Pnt(0.0, 0.0, 0.0), towards, right)))
    algorithm.Update()
    algorithm.Hide()
    lines = HLRBRep_HLRToShape(algorithm)
    views = []
    for shape in shapes:
        seen = _edges(lines.VCompound(shape.wrapped), lines.OutLineVCompound(shape.wrapped))
        hidden = _edges(lines.HCompound(shape.wrapped), lines.OutLineHCompound(shape.wrapped))
        views.append(View(seen=seen, hidden=hidden))
    return views


def _edges(*compounds: TopoDS_Shape) -> list[cq.Edge]:
    edges: list[cq.Edge] = []
    for compound in compounds:
        if compound and not compound.IsNull():  # a solid with no line of a kind has no compound of them
            BRepLib.BuildCurves3d_s(compound)
            edges += cq.Shape(compound).Edges()
    return edges


def draw_view(canvas: Canvas, view: View, at: Point = (0.0, 0.0), *, hidden: bool = False) -> None:
    """Draw a view, the origin of the solid at a point of the sheet [mm], with dashes where something is hidden."""
    draw_edges(canvas, [edge.translate(cq.Vector(*at, 0.0)) for edge in view.seen])
    if not hidden:
        return
    seen = shapely.union_all([shapely.LineString(edge_points(edge)) for edge in view.seen])
    behind = shapely.union_all([shapely.LineString(edge_points(edge)) for edge in view.hidden])
    alone = shapely.line_merge(behind.difference(seen.buffer(_SAME_MM)))
    for line in shapely.get_parts(alone):
        points = [(at[0] + x, at[1] + y) for x, y in line.simplify(_SAME_MM).coords]
        if line.length > 2.0 * _SAME_MM:
            canvas.polyline(points, "HIDDEN")


def draw_edges(canvas: Canvas, edges: Sequence[cq.Edge]) -> None:
    """Draw edges in the plane z = 0: lines, arcs and circles as such, other curves by short lines."""
    for edge in edges:
        points = edge_points(edge)
        if edge.geomType() != "CIRCLE":
            canvas.polyline(points)
            continue
        centre = edge.arcCenter()
        if edge.IsClosed():
            canvas.circle((centre.x, centre.y), edge.radius())
            continue
        first, middle, last = (_angle(centre, edge.positionAt(share)) for share in (0.0, 0.5, 1.0))
        if (middle - first) % _FULL_DEG > (last - first) % _FULL_DEG:  # the edge runs clockwise
            first, last = last, first
        canvas.arc((centre.x, centre.y), edge.radius(), first, last)


def edge_points(edge: cq.Edge) -> list[Point]:
    """Return points along an edge [mm], no more than its ends where it is straight."""
    positions = [edge.positionAt(step / _STEPS) for step in range(_STEPS + 1)]
    points = [(position.x, position.y) for position in positions]
    straight = math.dist(points[0], points[-1])
    along = sum(math.dist(points[step], points[step + 1]) for step in range(_STEPS))
    return [points[0], points[-1]] if along < straight + _SAME_MM**2 else points


def _angle(centre: cq.Vector, point: cq.Vector) -> float:
    return math.degrees(math.atan2(point.y - centre.y, point.x - centre.x)) % _FULL_DEG
