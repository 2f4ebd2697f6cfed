"""The plane across the depth in which a solid is cut: its edges and its hatched faces, x to the right and z up."""

from __future__ import annotations

import math

import cadquery as cq

from cad.drawing.canvas import Canvas, Point
from cad.drawing.view import draw_edges

_WIDE = 4e3  # [mm] of the cutting plane, far beyond any part
_STEPS = 24  # straight lines for an arc of an outline that is hatched


def section(shape: cq.Shape) -> cq.Shape:
    """Return what the plane y = 0 cuts of a solid [mm], laid into the plane z = 0."""
    plane = cq.Face.makePlane(_WIDE, _WIDE, cq.Vector(0.0, 0.0, 0.0), cq.Vector(0.0, 1.0, 0.0))
    return plane.intersect(shape).rotate(cq.Vector(0.0, 0.0, 0.0), cq.Vector(1.0, 0.0, 0.0), -90.0)


def draw_section(canvas: Canvas, cut: cq.Shape) -> None:
    """Draw the lines, arcs and circles of a section."""
    draw_edges(canvas, cut.Edges())


def hatch_section(canvas: Canvas, cut: cq.Shape) -> None:
    """Hatch a section; texts that stand there already stay free."""
    for face in cut.Faces():
        canvas.hatch([_outline(wire) for wire in (face.outerWire(), *face.innerWires())])


def _outline(wire: cq.Wire) -> list[Point]:
    """Return points along a closed wire [mm], arcs as short straight lines."""
    outline: list[Point] = []
    for edge in wire:
        steps = 1 if edge.geomType() == "LINE" else _STEPS
        points = [edge.positionAt(step / steps) for step in range(steps + 1)]
        along = [(point.x, point.y) for point in points]
        if outline and math.dist(outline[-1], along[0]) > math.dist(outline[-1], along[-1]):
            along.reverse()
        elif not outline and len(wire.Edges()) > 1:
            follows = [next_edge.positionAt(end) for next_edge in list(wire)[1:2] for end in (0.0, 1.0)]
            near = [(point.x, point.y) for point in follows]
            if min(math.dist(along[0], point) for point in near) < min(math.dist(along[-1], point) for point in near):
                along.reverse()
        outline += along if not outline else along[1:]
    return outline
