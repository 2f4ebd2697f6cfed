"""Marks on the frame, where nothing bends: L and H beside the springs and the design's name on the bar above.

They are engraved in the face that lies up in print pose, y = -depth / 2, and read from there.
"""

from collections.abc import Callable

import cadquery as cq
import shapely

from cad.parts.housing import Housing
from cad.parts.lettering import letters_that_fit, outlines
from cad.parts.part import Part, named_part

ENGRAVED_MM = 0.3
PEN_MM = 0.5  # the widest of the least gaps of the processes
TALLEST_MM, SMALLEST_MM = 4.0, 3.0  # smaller letters would leave walls under 0.8 mm between their strokes
_EDGE_MM = 1.0  # left free around a text
_NEAR = 1e-6


def marked(part: Part, housing: Housing, name: str) -> Part:
    """Return the housing with L, H and a name (letters, digits, - and _) engraved 0.3 mm deep; named faces stay.

    A name that is too long is cut short; a place that is too small for letters of 3 mm stays blank.
    """
    wall = 0.5 * housing.wall_width
    middle = 0.5 * (housing.protrusion + housing.top_level)
    bar = (0.5 * (housing.left + housing.right), 0.5 * (housing.cavity_level + housing.top_level))
    room = (housing.right - housing.left - 2.0 * housing.wall_width, housing.top_level - housing.cavity_level)
    beside = (housing.wall_width, housing.top_level - housing.protrusion - 4.0 * housing.hole_inset)
    tools = [
        *_tools(name, bar, room, housing),
        *_tools("L", (housing.left + wall, middle), beside, housing),
        *_tools("H", (housing.right - wall, middle), beside, housing),
    ]
    if not tools:
        return part
    return _renamed(part, part.shape.cut(*tools))


def _tools(text: str, centre: tuple[float, float], room: tuple[float, float], housing: Housing) -> list[cq.Solid]:
    """Return what is cut away for a text at a place (x, z), in a room of that width and height [mm]."""
    height = min(TALLEST_MM, room[1] - PEN_MM - 2.0 * _EDGE_MM)
    if height < SMALLEST_MM:
        return []
    fitting = letters_that_fit(text, height, room[0] - PEN_MM - 2.0 * _EDGE_MM)
    return [_tool(area, centre, -0.5 * housing.depth) for area in outlines(fitting, height, PEN_MM)] if fitting else []


def _tool(area: shapely.Polygon, centre: tuple[float, float], face: float) -> cq.Solid:
    def wire(ring: shapely.LinearRing) -> cq.Wire:
        points = [cq.Vector(centre[0] + x, face - ENGRAVED_MM, centre[1] + z) for x, z in ring.coords[:-1]]
        return cq.Wire.makePolygon(points, close=True)

    outer, inner = wire(area.exterior), [wire(ring) for ring in area.interiors]
    return cq.Solid.extrudeLinear(outer, inner, cq.Vector(0.0, 2.0 * ENGRAVED_MM, 0.0))


def _renamed(part: Part, shape: cq.Shape) -> Part:
    """Return the part with another shape whose named faces are those at the same places with the same areas."""
    every = part.shape.Faces()

    def like(indices: tuple[int, ...]) -> Callable[[cq.Face], bool]:
        known = [(every[i].Center(), every[i].Area()) for i in indices]

        def belongs(face: cq.Face) -> bool:
            return any(
                (face.Center() - centre).Length < _NEAR and abs(face.Area() - area) < _NEAR for centre, area in known
            )

        return belongs

    solid = shape.Solids()[0] if len(shape.Solids()) == 1 else shape
    return named_part(part.name, solid, {name: like(indices) for name, indices in part.faces.items()})
