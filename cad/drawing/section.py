"""The section of a solid at mid-depth: its edges and its hatched faces, with x to the right and z up."""

from __future__ import annotations

import cadquery as cq
from OCP.TopAbs import TopAbs_Orientation

from cad.drawing.canvas import Canvas, Point
from cad.drawing.projection import draw_edges, edge_points

_WIDTH = 4e3  # side of the cutting plane [mm], far larger than any part


def section(shape: cq.Shape) -> cq.Shape:
    """Return the section of a solid by the plane y = 0 [mm], rotated into the plane z = 0 for drawing."""
    plane = cq.Face.makePlane(_WIDTH, _WIDTH, cq.Vector(0.0, 0.0, 0.0), cq.Vector(0.0, 1.0, 0.0))
    return plane.intersect(shape).rotate(cq.Vector(0.0, 0.0, 0.0), cq.Vector(1.0, 0.0, 0.0), -90.0)


def draw_section(canvas: Canvas, cut: cq.Shape, layer: str = "PART") -> None:
    """Draw the edges of a section."""
    draw_edges(canvas, cut.Edges(), layer)


def hatch_section(canvas: Canvas, cut: cq.Shape) -> None:
    """Hatch the faces of a section, leaving out the texts that are already drawn on them."""
    for face in cut.Faces():
        canvas.hatch([_outline(wire) for wire in (face.outerWire(), *face.innerWires())])


def _outline(wire: cq.Wire) -> list[Point]:
    """Return points along a closed wire [mm]; curves become straight segments."""
    outline: list[Point] = []
    for edge in wire:  # in the order of the wire; a reversed edge runs against its own direction
        points = edge_points(edge)
        outline += reversed(points) if edge.wrapped.Orientation() == TopAbs_Orientation.TopAbs_REVERSED else points
    return outline
