"""Lines and arcs in which a plane across the depth cuts a solid."""

from __future__ import annotations

import math
from collections.abc import Sequence

import cadquery as cq

from cad.drawing.canvas import Canvas, Point

_WIDE = 4e3  # [mm] of the cutting plane, far beyond any part
_FULL_DEG = 360.0
_STEPS = 24  # straight lines for an arc of an outline that is hatched


def section(shape: cq.Shape, y: float = 0.0) -> Sequence[cq.Edge]:
    """Return the edges in which a plane at y [mm] cuts a solid."""
    plane = cq.Face.makePlane(_WIDE, _WIDE, cq.Vector(0.0, y, 0.0), cq.Vector(0.0, 1.0, 0.0))
    return plane.intersect(shape).Edges()


def hatch_section(canvas: Canvas, shape: cq.Shape, y: float = 0.0) -> None:
    """Hatch what a plane at y [mm] cuts of a solid; texts that stand there already stay free."""
    plane = cq.Face.makePlane(_WIDE, _WIDE, cq.Vector(0.0, y, 0.0), cq.Vector(0.0, 1.0, 0.0))
    for face in plane.intersect(shape).Faces():
        canvas.hatch([_outline(wire) for wire in (face.outerWire(), *face.innerWires())])


def _outline(wire: cq.Wire) -> list[Point]:
    """Return points x, z [mm] along a closed wire, arcs as short straight lines."""
    outline: list[Point] = []
    for edge in wire:
        steps = 1 if edge.geomType() == "LINE" else _STEPS
        points = [edge.positionAt(step / steps) for step in range(steps + 1)]
        along = [(point.x, point.z) for point in points]
        if outline and math.dist(outline[-1], along[0]) > math.dist(outline[-1], along[-1]):
            along.reverse()
        elif not outline and len(wire.Edges()) > 1:
            follows = [next_edge.positionAt(end) for next_edge in list(wire)[1:2] for end in (0.0, 1.0)]
            near = [(point.x, point.z) for point in follows]
            if min(math.dist(along[0], point) for point in near) < min(math.dist(along[-1], point) for point in near):
                along.reverse()
        outline += along if not outline else along[1:]
    return outline


def draw_section(canvas: Canvas, edges: Sequence[cq.Edge]) -> None:
    """Draw the lines, arcs and circles of a section, x to the right and z up."""
    for edge in edges:
        start, end = edge.startPoint(), edge.endPoint()
        if edge.geomType() == "LINE":
            canvas.line((start.x, start.z), (end.x, end.z))
            continue
        centre = edge.arcCenter()
        if edge.IsClosed():
            canvas.circle((centre.x, centre.z), edge.radius())
            continue
        first, middle, last = (_angle(centre, point) for point in (start, edge.positionAt(0.5), end))
        if (middle - first) % _FULL_DEG > (last - first) % _FULL_DEG:  # the edge runs clockwise
            first, last = last, first
        canvas.arc((centre.x, centre.z), edge.radius(), first, last)


def _angle(centre: cq.Vector, point: cq.Vector) -> float:
    return math.degrees(math.atan2(point.z - centre.z, point.x - centre.x)) % _FULL_DEG
