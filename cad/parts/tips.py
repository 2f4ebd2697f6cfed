"""The tips: as separate solids, for a ground steel tip instead of a printed one, and as measured on a housing.

Sensor frame: the tips stand on z = 0, their middles on the x axis. Units: mm.
"""

import cadquery as cq

from cad.design.parameters import Tips
from cad.parts.housing import Housing
from cad.parts.part import Part, named_part
from cad.verdict import Verdict, equal

PLACE_TOLERANCE_MM = 1e-3
_NEAR = 1e-6
_DOWNWARD = -0.5  # of a normal along z: nearer to level than to upright


def tip_parts(tips: Tips, height: float) -> tuple[Part, Part]:
    """Return the low and the high tip [mm] as solids of the given height with the face or cap that touches, `touch`."""
    half = 0.5 * tips.spacing_mm
    return _tip_part("low tip", tips, height, -half), _tip_part("high tip", tips, height, half)


def _tip_part(name: str, tips: Tips, height: float, x: float) -> Part:
    solid = _tip_solid(tips, height).translate(cq.Vector(x, 0.0, 0.0))
    return named_part(name, solid, {"touch": lambda face: abs(face.BoundingBox().zmin) < _NEAR and _looks_down(face)})


def _tip_solid(tips: Tips, height: float) -> cq.Shape:
    side, up = tips.side_mm, cq.Vector(0.0, 0.0, 1.0)
    if tips.shape == "sphere":
        return _dome(0.5 * side, height)
    if tips.shape == "cylinder":
        solid: cq.Solid = cq.Solid.makeCylinder(0.5 * side, height, cq.Vector(0.0, 0.0, 0.0), up)
    else:
        solid = cq.Solid.makeBox(side, side, height, cq.Vector(-0.5 * side, -0.5 * side, 0.0))
    if tips.fillet_mm == 0.0:
        return solid
    rounded: cq.Shape = solid.fillet(tips.fillet_mm, [edge for edge in solid.Edges() if _at_foot(edge)])
    return rounded


def _dome(radius: float, height: float) -> cq.Shape:
    """Return a round pin that ends in half a ball."""
    origin, up = cq.Vector(0.0, 0.0, radius), cq.Vector(0.0, 0.0, 1.0)
    ball = cq.Solid.makeSphere(radius, origin, up, -90.0, 0.0, 360.0)
    return ball.fuse(cq.Solid.makeCylinder(radius, max(height - radius, _NEAR), origin, up)).Solids()[0]


def _at_foot(edge: cq.Edge) -> bool:
    return bool(edge.BoundingBox().zmax < _NEAR)


def _looks_down(face: cq.Face) -> bool:
    return bool(face.geomType() == "SPHERE" or face.normalAt().z < _DOWNWARD)


def tip_finding(part: Part, housing: Housing) -> Verdict:
    """Return geometry.tips [mm]: how far an edge of a tip's face is off the declared side, spacing and level."""
    half, side = 0.5 * housing.tip_side, 0.5 * housing.spacing
    off = 0.0
    for name, x in (("low_tip", -side), ("high_tip", side)):
        boxes = [part.shape.Faces()[index].BoundingBox() for index in part.faces[name]]
        found = (
            min(box.xmin for box in boxes), max(box.xmax for box in boxes), min(box.ymin for box in boxes),
            max(box.ymax for box in boxes), min(box.zmin for box in boxes), max(box.zmax for box in boxes),
        )  # fmt: skip
        declared = (x - half, x + half, -half, half, 0.0, 0.0)
        off = max(off, *(abs(a - b) for a, b in zip(found, declared, strict=True)))
    reference = f"edges of both tip faces: side {housing.tip_side:g}, spacing {housing.spacing:g} mm, at z = 0"
    return equal("geometry.tips", off, 0.0, PLACE_TOLERANCE_MM, unit="mm", reference=reference)
