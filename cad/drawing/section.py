"""The section of a solid at mid-depth, drawn with its edges and hatched faces; x is to the right, and z is up."""

from __future__ import annotations

import cadquery as cq
from OCP.TopAbs import TopAbs_Orientation

from cad.drawing.canvas import Canvas, Point
from cad.drawing.projection import draw_edges, edge_points

_PLANE_MM = 4e3  # width of the cutting plane, far larger than any part


def section(shape: cq.Shape) -> cq.Shape:
    """Return the section of a solid in the plane y = 0 [mm], rotated into the plane z = 0 for drawing."""
    plane = cq.Face.makePlane(_PLANE_MM, _PLANE_MM, cq.Vector(0.0, 0.0, 0.0), cq.Vector(0.0, 1.0, 0.0))
    return plane.intersect(shape).rotate(cq.Vector(0.0, 0.0, 0.0), cq.Vector(1.0, 0.0, 0.0), -90.0)


def draw_section(canvas: Canvas, cut: cq.Shape, layer: str = "PART") -> None:
    """Draw the edges of a section that was computed by `section`."""
    draw_edges(canvas, cut.Edges(), layer)


def hatch_section(canvas: Canvas, cut: cq.Shape) -> None:
    """Hatch the faces of a section, except where texts are already written on them."""
    for face in cut.Faces():
        canvas.hatch([_outline(wire) for wire in (face.outerWire(), *face.innerWires())])


def _outline(wire: cq.Wire) -> list[Point]:
    """Return points along a closed wire [mm]; curves are replaced by straight segments."""
    outline: list[Point] = []
    for edge in wire:
        points = edge_points(edge)
        # The wire passes through a reversed edge from its end to its start.
        outline += reversed(points) if edge.wrapped.Orientation() == TopAbs_Orientation.TopAbs_REVERSED else points
    return outline
