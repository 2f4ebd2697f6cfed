"""Lines and arcs in which a plane across the depth cuts a solid."""

import math
from collections.abc import Iterator

import cadquery as cq

from cad.drawing.items import FULL_DEG, Arc, Line

_WIDE = 4e3  # [mm] of the cutting plane, far beyond any part


def section(shape: cq.Shape, y: float = 0.0) -> Iterator[Line | Arc]:
    """Yield the lines and arcs in which a plane at y [mm] cuts a solid, x to the right and z up."""
    plane = cq.Face.makePlane(_WIDE, _WIDE, cq.Vector(0.0, y, 0.0), cq.Vector(0.0, 1.0, 0.0))
    for edge in plane.intersect(shape).Edges():
        if edge.geomType() == "LINE":
            start, end = edge.startPoint(), edge.endPoint()
            yield Line(start=(start.x, start.z), end=(end.x, end.z))
        else:
            yield _arc(edge)


def _arc(edge: cq.Edge) -> Arc:
    centre, middle = edge.arcCenter(), edge.positionAt(0.5)
    if edge.IsClosed():
        return Arc(centre=(centre.x, centre.z), radius=edge.radius(), start=0.0, end=FULL_DEG)
    a, b, m = (
        math.degrees(math.atan2(point.z - centre.z, point.x - centre.x)) % FULL_DEG
        for point in (edge.startPoint(), edge.endPoint(), middle)
    )
    if (m - a) % FULL_DEG > (b - a) % FULL_DEG:
        a, b = b, a
    return Arc(centre=(centre.x, centre.z), radius=edge.radius(), start=a, end=a + (b - a) % FULL_DEG)
