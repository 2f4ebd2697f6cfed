"""The fruit with the footprints of the tips on its top: a block, whole or cut where it is symmetric, or curved.

x runs along the tips, y across, z along the press; the apex, or the middle of a block's top, is the origin. Units: mm.
"""

from __future__ import annotations

import cadquery as cq

from cad.design.fruit import Fruit
from cad.design.tips import Tips, check_tips_on_fruit
from cad.parts.part import NEAR_MM, FaceTest, Part, named_part, on_plane
from cad.quantity import validation_error

_NEAR_BOX_MM = 1e-3  # the box about a curved face is wider than it
_MIRROR_PLANES = {"symmetry_x": on_plane(0, 0.0), "symmetry_y": on_plane(1, 0.0)}


def fruit_block(fruit: Fruit, tips: Tips) -> Part:
    """Return the whole block [mm] with the faces base, top, low_tip, high_tip.

    Raises InputError when a tip stands beyond the fruit.
    """
    return _imprinted_block("fruit block", fruit, tips, ())


def solved_block(fruit: Fruit, tips: Tips) -> Part:
    """Return what is solved of a block [mm]: the quarter where the tips are central, else the half y >= 0."""
    return fruit_quarter(fruit, tips) if tips.offset_mm == 0.0 else fruit_half(fruit, tips)


def fruit_half(fruit: Fruit, tips: Tips) -> Part:
    """Return the half y >= 0 of the block [mm] with the faces base, top, low_tip, high_tip, symmetry_y.

    Raises InputError when a tip stands beyond the fruit.
    """
    return _imprinted_block("fruit half", fruit, tips, ("symmetry_y",))


def fruit_quarter(fruit: Fruit, tips: Tips) -> Part:
    """Return the quarter x >= 0, y >= 0 [mm] with the faces base, top, high_tip, symmetry_x, symmetry_y.

    Raises InputError when the tips are off the centre, or stand beyond the fruit.
    """
    if tips.offset_mm != 0.0:
        raise validation_error(
            "tips.offset_mm", tips.offset_mm, "mm", "0 for a quarter of the fruit", "take fruit_half"
        )
    return _imprinted_block("fruit quarter", fruit, tips, ("symmetry_x", "symmetry_y"))


def tip_centres(tips: Tips) -> dict[str, float]:
    """Return x of the centre of each footprint by face name [mm]."""
    return dict(zip(("low_tip", "high_tip"), tips.centres_mm, strict=True))


def _imprinted_block(name: str, fruit: Fruit, tips: Tips, symmetry: tuple[str, ...]) -> Part:
    check_tips_on_fruit(fruit, tips)
    x = 0.0 if "symmetry_x" in symmetry else -0.5 * fruit.length_mm
    y = 0.0 if "symmetry_y" in symmetry else -0.5 * fruit.width_mm
    corner = cq.Vector(x, y, -fruit.height_mm)
    block = cq.Solid.makeBox(0.5 * fruit.length_mm - x, 0.5 * fruit.width_mm - y, fruit.height_mm, corner)
    centres = {face: centre for face, centre in tip_centres(tips).items() if centre > x}
    imprinted = block.split(*(_footprint(tips, centre) for centre in centres.values())).Solids()[0]
    planes = {plane: _MIRROR_PLANES[plane] for plane in symmetry}
    faces = _top_faces(tips, centres, on_plane(2, 0.0), NEAR_MM)
    return named_part(name, imprinted, {"base": on_plane(2, -fruit.height_mm), **planes, **faces})


def _footprint(tips: Tips, centre: float) -> cq.Face:
    """Return the outline of a tip: a square, or a circle of four arcs, so that a mesh has its extreme points."""
    middle, up = cq.Vector(centre, 0.0, 0.0), cq.Vector(0.0, 0.0, 1.0)
    if not tips.tip_shape.is_round:
        return cq.Face.makePlane(tips.side_mm, tips.side_mm, middle)
    radius = 0.5 * tips.side_mm
    arcs = [cq.Edge.makeCircle(radius, middle, up, start, start + 90.0) for start in (0.0, 90.0, 180.0, 270.0)]
    return cq.Face.makeFromWires(cq.Wire.assembleEdges(arcs))


def _top_faces(tips: Tips, centres: dict[str, float], on_top: FaceTest, near: float) -> dict[str, FaceTest]:
    """Return the tests that pick on the top each face in the plan of a tip, and as `top` what is left of it."""
    reach = 0.5 * tips.side_mm + near

    def under_tip(centre: float) -> FaceTest:
        def is_under(face: cq.Face) -> bool:
            box = face.BoundingBox()
            return on_top(face) and max(centre - box.xmin, box.xmax - centre, box.ymax) < reach

        return is_under

    footprints = {name: under_tip(centre) for name, centre in centres.items()}
    return {"top": lambda face: on_top(face) and not any(test(face) for test in footprints.values()), **footprints}


def _is_curved(face: cq.Face) -> bool:
    return face.geomType() != "PLANE"


def curved_fruit(fruit: Fruit, tips: Tips | None = None) -> Part:
    """Return the piece of a sphere or ellipsoid [mm] with the faces base and top; with tips also low_tip and high_tip.

    The tips leave their outlines as seen from above. Raises InputError for a block.
    """
    if fruit.radius_mm is None:
        raise validation_error("fruit.shape", fruit.shape, "", "sphere or ellipsoid", "take fruit_block")
    piece = _curved_piece(fruit, fruit.radius_mm)
    faces: dict[str, FaceTest] = {"top": _is_curved}
    if tips is not None:
        centres = tip_centres(tips)
        piece = piece.split(*(_outline(piece, tips, centre) for centre in centres.values())).Solids()[0]
        faces = _top_faces(tips, centres, _is_curved, _NEAR_BOX_MM)
    return named_part(f"fruit {fruit.shape}", piece, {"base": on_plane(2, -fruit.depth_mm), **faces})


def curved_half(fruit: Fruit, tips: Tips) -> Part:
    """Return the half y >= 0 of the piece [mm] with the faces base, top, low_tip, high_tip and symmetry_y.

    The tips leave their outlines as seen from above. Raises InputError for a block.
    """
    whole = curved_fruit(fruit, tips).shape
    far = whole.BoundingBox().DiagonalLength
    half = whole.intersect(cq.Solid.makeBox(2.0 * far, far, 2.0 * far, cq.Vector(-far, 0.0, -far))).Solids()[0]
    planes = {"base": on_plane(2, -fruit.depth_mm), "symmetry_y": _MIRROR_PLANES["symmetry_y"]}
    faces = _top_faces(tips, tip_centres(tips), _is_curved, _NEAR_BOX_MM)
    return named_part(f"half of a fruit {fruit.shape}", half, {**planes, **faces})


def bare_fruit(fruit: Fruit) -> cq.Shape:
    """Return the fruit without outlines of tips [mm], its apex or the middle of its top at the origin."""
    if fruit.shape != "block":
        return curved_fruit(fruit).shape
    corner = cq.Vector(-0.5 * fruit.length_mm, -0.5 * fruit.width_mm, -fruit.depth_mm)
    return cq.Solid.makeBox(fruit.length_mm, fruit.width_mm, fruit.depth_mm, corner)


def _curved_piece(fruit: Fruit, radius: float) -> cq.Solid:
    """Return the piece with its apex at the origin; poles and seam of the surface lie away from the top."""
    length, width, depth = fruit.length_mm, fruit.width_mm, fruit.depth_mm
    if fruit.radius_across_mm is None:
        sphere: cq.Shape = cq.Solid.makeSphere(radius, angleDegrees1=-90, angleDegrees2=90)
        whole = sphere.rotate(cq.Vector(0.0, 0.0, 0.0), cq.Vector(0.0, 1.0, 0.0), 90.0)
    else:
        whole = _ellipsoid(radius, (radius * fruit.radius_across_mm) ** 0.5, beyond_equator=depth > radius)
    box = cq.Solid.makeBox(length, width, 2.0 * depth, cq.Vector(-0.5 * length, -0.5 * width, -depth))
    return whole.translate(cq.Vector(0.0, 0.0, -radius)).intersect(box).Solids()[0]


def _ellipsoid(radius: float, across: float, *, beyond_equator: bool) -> cq.Shape:
    """Return the body that a half ellipse leaves when it turns about y, of half axes radius and across [mm].

    It is the upper half, or the whole: of two surfaces and from a spline, for one surface all around, or one with a
    pole where an ellipse starts, is read back wrong from a STEP file.
    """
    middle, axis = cq.Vector(0.0, 0.0, 0.0), cq.Vector(0.0, 1.0, 0.0)
    half = cq.Edge.makeEllipse(across, radius, middle, cq.Vector(0.0, 0.0, -1.0), axis, 0.0, 180.0)
    if beyond_equator:
        half = half.toNURBS()
    outline = cq.Wire.assembleEdges([half, cq.Edge.makeLine(half.endPoint(), half.startPoint())])
    upper = cq.Solid.revolve(outline, [], -180.0, middle, axis)
    return upper.fuse(cq.Solid.revolve(outline, [], 180.0, middle, axis)) if beyond_equator else upper


def _outline(piece: cq.Solid, tips: Tips, centre: float) -> cq.Face:
    """Return the part of the top that lies under a tip."""
    side, far = tips.side_mm, piece.BoundingBox().DiagonalLength
    if not tips.tip_shape.is_round:
        above = cq.Solid.makeBox(side, side, 2.0 * far, cq.Vector(centre - 0.5 * side, -0.5 * side, -far))
    else:
        above = cq.Solid.makeCylinder(0.5 * side, 2.0 * far, cq.Vector(centre, 0.0, -far))
    curved = [face for face in piece.Faces() if face.geomType() != "PLANE"]
    top = max(curved, key=lambda face: face.BoundingBox().zmax)
    return top.intersect(above).Faces()[0]
