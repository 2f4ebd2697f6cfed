"""A curved fruit: the piece of a sphere or an ellipsoid that the tips press on, with their outlines on its top.

Axes as for the block: x along the tips, y across, z along the press, the apex at the origin. Units: mm.
"""

from collections.abc import Callable

import cadquery as cq

from cad.design.parameters import Fruit, Tips
from cad.parts.fruit import tip_centres
from cad.parts.part import Part, named_part
from cad.quantity import fault

_TOUCH = 1e-6  # [mm], see cad/fruit.py
_SAME = 1e-4  # relative: areas of curved faces are sums


def curved_fruit(fruit: Fruit, tips: Tips | None = None) -> Part:
    """Return the piece [mm] with the faces base and top; with tips also low_tip and high_tip, as seen from above.

    Raises InputError for a block.
    """
    if fruit.radius_mm is None:
        raise fault("fruit.shape", fruit.shape, "", "sphere or ellipsoid", "take fruit_block")
    half_length, half_width, depth = 0.5 * fruit.length_mm, 0.5 * fruit.width_mm, fruit.depth_mm
    box = cq.Solid.makeBox(fruit.length_mm, fruit.width_mm, 2.0 * depth, cq.Vector(-half_length, -half_width, -depth))
    piece = _whole(fruit, fruit.radius_mm).intersect(box).Solids()[0]
    outlines = [_outline(piece, tips, centre) for centre in tip_centres(tips).values()] if tips else []
    if outlines:
        piece = piece.split(*outlines).Solids()[0]
    tests = {name: _same_as(face) for name, face in zip(("low_tip", "high_tip"), outlines, strict=False)}

    def top(face: cq.Face) -> bool:
        return face.geomType() != "PLANE" and not any(test(face) for test in tests.values())

    def base(face: cq.Face) -> bool:
        box = face.BoundingBox()
        return face.geomType() == "PLANE" and box.zmax < -depth + _TOUCH

    return named_part(f"fruit {fruit.shape}", piece, {"base": base, "top": top, **tests})


def _same_as(outline: cq.Face) -> Callable[[cq.Face], bool]:
    """Pick the face that an outline has become."""
    centre, area = outline.Center(), outline.Area()

    def same(face: cq.Face) -> bool:
        return (face.Center() - centre).Length < _SAME * area**0.5 and abs(face.Area() - area) < _SAME * area

    return same


def _whole(fruit: Fruit, radius: float) -> cq.Shape:
    """Return the whole fruit with its apex at the origin; poles and seam of the surface lie away from the top."""
    sphere = cq.Solid.makeSphere(radius, angleDegrees1=-90, angleDegrees2=90).rotate(
        cq.Vector(0.0, 0.0, 0.0), cq.Vector(0.0, 1.0, 0.0), 90.0
    )
    across = fruit.radius_across_mm
    if across is not None:
        stretch = (across / radius) ** 0.5
        sphere = sphere.transformGeometry(cq.Matrix([[1, 0, 0, 0], [0, stretch, 0, 0], [0, 0, 1, 0]]))
    return sphere.translate(cq.Vector(0.0, 0.0, -radius))


def _outline(piece: cq.Solid, tips: Tips, centre: float) -> cq.Face:
    """Return the part of the top that lies under a tip."""
    side, far = tips.side_mm, piece.BoundingBox().DiagonalLength
    if tips.shape == "cube":
        above = cq.Solid.makeBox(side, side, 2.0 * far, cq.Vector(centre - 0.5 * side, -0.5 * side, -far))
    else:
        above = cq.Solid.makeCylinder(0.5 * side, 2.0 * far, cq.Vector(centre, 0.0, -far))
    curved = [face for face in piece.Faces() if face.geomType() != "PLANE"]
    return curved[0].intersect(above).Faces()[0]
