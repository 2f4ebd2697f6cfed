"""The fruit with the footprints of the tips on its top: a block, whole or cut where it is symmetric, or curved.

x runs along the tips, y across, z along the press; the apex, or the middle of a block's top, is the origin. Units: mm.
"""

from __future__ import annotations

from collections.abc import Sequence

import cadquery as cq

from cad.parts.part import NEAR_MM, FaceTest, Part, named_part, on_plane
from sensor.design.fruit import Fruit
from sensor.design.tips import Tips, check_tips_on_fruit
from sensor.quantity import validation_error

_NEAR_BOX_MM = 1e-3  # the box about a curved face is wider than it
_MIRROR_PLANES = {"symmetry_x": on_plane(0, 0.0), "symmetry_y": on_plane(1, 0.0)}
HALF = ("symmetry_y",)
QUARTER = ("symmetry_x", "symmetry_y")


def fruit_block(fruit: Fruit, tips: Tips, mirrors: Sequence[str] = ()) -> Part:
    """Return the block [mm] with the faces base, top, low_tip and high_tip, or the part that stands for the whole.

    `mirrors` name its planes of symmetry, which are faces of the part too. "symmetry_x" leaves x >= 0, which has no low
    tip, and "symmetry_y" leaves y >= 0. Raises InputError when a tip stands beyond the fruit.
    """
    check_tips_on_fruit(fruit, tips)
    right = 0.5 * fruit.length_mm
    back = 0.5 * fruit.width_mm
    left = 0.0 if "symmetry_x" in mirrors else -right
    front = 0.0 if "symmetry_y" in mirrors else -back
    corner = cq.Vector(left, front, -fruit.height_mm)
    block = cq.Solid.makeBox(right - left, back - front, fruit.height_mm, corner)
    centres = {face: x for face, x in _tip_centres(tips).items() if x > left}
    faces = {
        "base": on_plane(2, -fruit.height_mm),
        **{plane: _MIRROR_PLANES[plane] for plane in mirrors},
        **_top_faces(tips, centres, on_plane(2, 0.0), NEAR_MM),
    }
    divided = block.split(*(_footprint(tips, x) for x in centres.values()))
    return named_part("fruit block", divided, faces)


def _tip_centres(tips: Tips) -> dict[str, float]:
    """Return x of the centre of each footprint by face name [mm]."""
    return dict(zip(("low_tip", "high_tip"), tips.centres_mm, strict=True))


def _footprint(tips: Tips, x: float) -> cq.Face:
    """Return the outline of a tip: a square, or a circle of four arcs, so that a mesh has its extreme points."""
    middle = cq.Vector(x, 0.0, 0.0)
    if not tips.tip_shape.is_round:
        return cq.Face.makePlane(tips.side_mm, tips.side_mm, middle)
    up = cq.Vector(0.0, 0.0, 1.0)
    arcs = [cq.Edge.makeCircle(0.5 * tips.side_mm, middle, up, start, start + 90.0) for start in (0, 90, 180, 270)]
    return cq.Face.makeFromWires(cq.Wire.assembleEdges(arcs))


def _top_faces(tips: Tips, centres: dict[str, float], on_top: FaceTest, near: float) -> dict[str, FaceTest]:
    """Return the tests that pick by name the faces of the top: each one under a tip, and as "top" all others.

    `centres` are x of the tips by name, `on_top` picks the whole top; a face may be `near` wider than its tip [mm].
    """
    reach = 0.5 * tips.side_mm + near

    def under_tip(x: float) -> FaceTest:
        def is_under(face: cq.Face) -> bool:
            box = face.BoundingBox()
            return on_top(face) and max(x - box.xmin, box.xmax - x, box.ymax) < reach

        return is_under

    footprints = {name: under_tip(x) for name, x in centres.items()}
    return {"top": lambda face: on_top(face) and not any(test(face) for test in footprints.values()), **footprints}


def _is_curved(face: cq.Face) -> bool:
    return face.geomType() != "PLANE"


def curved_fruit(fruit: Fruit, tips: Tips | None = None, *, half: bool = False) -> Part:
    """Return the piece of a sphere or ellipsoid [mm] with the faces base and top; with tips also low_tip and high_tip.

    The tips leave their outlines as seen from above. The half y >= 0 has the face symmetry_y too. Raises InputError for
    a block.
    """
    if fruit.radius_mm is None:
        raise validation_error("fruit.shape", fruit.shape, "", "sphere or ellipsoid", "take fruit_block")
    piece: cq.Shape = _curved_piece(fruit, fruit.radius_mm)
    faces: dict[str, FaceTest] = {"base": on_plane(2, -fruit.depth_mm), "top": _is_curved}
    if tips is not None:
        centres = _tip_centres(tips)
        faces.update(_top_faces(tips, centres, _is_curved, _NEAR_BOX_MM))
        piece = piece.split(*(_outline(piece, tips, x) for x in centres.values()))
    if half:
        far = piece.BoundingBox().DiagonalLength
        all_behind = cq.Solid.makeBox(2.0 * far, far, 2.0 * far, cq.Vector(-far, 0.0, -far))
        piece = piece.intersect(all_behind)
        faces["symmetry_y"] = _MIRROR_PLANES["symmetry_y"]
    return named_part(f"fruit {fruit.shape}", piece, faces)


def whole_fruit(fruit: Fruit, tips: Tips) -> cq.Shape:
    """Return the fruit [mm], its apex or the middle of its top at the origin, with the outlines of a pair of tips."""
    outlined = tips if tips.tip_layout.is_pair else None
    if fruit.shape != "block":
        return curved_fruit(fruit, outlined).shape
    return outer_box(fruit) if outlined is None else fruit_block(fruit, outlined).shape


def outer_box(fruit: Fruit, top: float = 0.0) -> cq.Solid:
    """Return the box of a fruit's length, width and depth below z = 0, and up to a level above its top [mm]."""
    corner = cq.Vector(-0.5 * fruit.length_mm, -0.5 * fruit.width_mm, -fruit.depth_mm)
    return cq.Solid.makeBox(fruit.length_mm, fruit.width_mm, fruit.depth_mm + top, corner)


def _curved_piece(fruit: Fruit, radius: float) -> cq.Solid:
    """Return the piece of a curved fruit with its apex at the origin [mm]; `radius` is that along the tips.

    Poles and seam of its surface lie away from the top, where the outlines of the tips will divide it.
    """
    if fruit.radius_across_mm is None:
        sphere: cq.Shape = cq.Solid.makeSphere(radius, angleDegrees1=-90, angleDegrees2=90)
        whole = sphere.rotate(cq.Vector(0.0, 0.0, 0.0), cq.Vector(0.0, 1.0, 0.0), 90.0)
    else:
        half_width = (radius * fruit.radius_across_mm) ** 0.5  # the half axis across that has this radius of curvature
        whole = _ellipsoid(radius, half_width, beyond_equator=fruit.depth_mm > radius)
    lowered = whole.translate(cq.Vector(0.0, 0.0, -radius))
    if fruit.azimuth_deg:
        lowered = lowered.rotate(cq.Vector(0.0, 0.0, 0.0), cq.Vector(0.0, 0.0, 1.0), fruit.azimuth_deg)
    return lowered.intersect(outer_box(fruit, top=fruit.depth_mm)).Solids()[0]


def _ellipsoid(radius: float, across: float, *, beyond_equator: bool) -> cq.Shape:
    """Return an ellipsoid of half axes `radius` along x and z and `across` along y [mm]: its upper half, or the whole.

    Half an ellipse turns about y. The whole has two surfaces, which turn a spline. One surface all around, or one with
    a pole where an ellipse starts, is read back wrong from a STEP file.
    """
    middle, axis = cq.Vector(0.0, 0.0, 0.0), cq.Vector(0.0, 1.0, 0.0)
    half = cq.Edge.makeEllipse(across, radius, middle, cq.Vector(0.0, 0.0, -1.0), axis, 0.0, 180.0)
    if beyond_equator:
        half = half.toNURBS()
    outline = cq.Wire.assembleEdges([half, cq.Edge.makeLine(half.endPoint(), half.startPoint())])
    upper = cq.Solid.revolve(outline, [], -180.0, middle, axis)
    return upper.fuse(cq.Solid.revolve(outline, [], 180.0, middle, axis)) if beyond_equator else upper


def _outline(piece: cq.Shape, tips: Tips, x: float) -> cq.Face:
    """Return the part of the curved top of a piece that lies under a tip at x [mm]."""
    side = tips.side_mm
    far = piece.BoundingBox().DiagonalLength
    if tips.tip_shape.is_round:
        column = cq.Solid.makeCylinder(0.5 * side, 2.0 * far, cq.Vector(x, 0.0, -far))
    else:
        column = cq.Solid.makeBox(side, side, 2.0 * far, cq.Vector(x - 0.5 * side, -0.5 * side, -far))
    curved = [face for face in piece.Faces() if _is_curved(face)]
    top = max(curved, key=lambda face: face.BoundingBox().zmax)
    return top.intersect(column).Faces()[0]
