"""The solid of a fruit, a block or a piece of a sphere or an ellipsoid, with the outlines of the tips on its top.

x runs along the tips, y across, and z against the press. The origin is the apex, or the centre of the top of a block.
All lengths in mm.
"""

from __future__ import annotations

import cadquery as cq

from sensor.design.fruit import Fruit
from sensor.design.tips import Tips


def whole_fruit(fruit: Fruit, tips: Tips) -> cq.Shape:
    """Return the fruit [mm]; its top is divided by the outlines of the tips of a pair, so that a mesh follows them."""
    body = outer_box(fruit) if fruit.radius_mm is None else _curved_piece(fruit, fruit.radius_mm)
    if not tips.tip_layout.is_pair:
        return body
    outlines = [footprint(tips, x) if fruit.radius_mm is None else _outline(body, tips, x) for x in tips.centres_mm]
    return body.split(*outlines).Solids()[0]


def footprint(tips: Tips, x: float) -> cq.Face:
    """Return the outline of a tip at x [mm] as a face in z = 0: a square or a circle.

    A circle consists of four arcs, so that a mesh has nodes at its extreme points.
    """
    middle = cq.Vector(x, 0.0, 0.0)
    if not tips.tip_shape.is_round:
        return cq.Face.makePlane(tips.side_mm, tips.side_mm, middle)
    up = cq.Vector(0.0, 0.0, 1.0)
    arcs = [cq.Edge.makeCircle(0.5 * tips.side_mm, middle, up, start, start + 90.0) for start in (0, 90, 180, 270)]
    return cq.Face.makeFromWires(cq.Wire.assembleEdges(arcs))


def outer_box(fruit: Fruit, top: float = 0.0) -> cq.Solid:
    """Return the box around a fruit: its length, width and depth below z = 0, and up to the level `top` [mm]."""
    corner = cq.Vector(-0.5 * fruit.length_mm, -0.5 * fruit.width_mm, -fruit.depth_mm)
    return cq.Solid.makeBox(fruit.length_mm, fruit.width_mm, fruit.depth_mm + top, corner)


def _curved_piece(fruit: Fruit, radius: float) -> cq.Solid:
    """Return the piece of a curved fruit with its apex at the origin; `radius` is measured along the tips [mm].

    Poles and seam of its surface are away from the top, because the outlines of the tips divide the top.
    """
    if fruit.radius_across_mm is None:
        sphere: cq.Shape = cq.Solid.makeSphere(radius, angleDegrees1=-90, angleDegrees2=90)
        whole = sphere.rotate(cq.Vector(0.0, 0.0, 0.0), cq.Vector(0.0, 1.0, 0.0), 90.0)
    else:
        half_width = (radius * fruit.radius_across_mm) ** 0.5  # semi-axis with this radius of curvature
        whole = _ellipsoid(radius, half_width, beyond_equator=fruit.depth_mm > radius)
    lowered = whole.translate(cq.Vector(0.0, 0.0, -radius))
    if fruit.azimuth_deg:
        lowered = lowered.rotate(cq.Vector(0.0, 0.0, 0.0), cq.Vector(0.0, 0.0, 1.0), fruit.azimuth_deg)
    return lowered.intersect(outer_box(fruit, top=fruit.depth_mm)).Solids()[0]


def _ellipsoid(radius: float, across: float, *, beyond_equator: bool) -> cq.Shape:
    """Return the upper half of an ellipsoid, or the whole, with semi-axes `radius` in x and z and `across` in y [mm].

    It is half an ellipse, revolved about y. The whole ellipsoid consists of two surfaces, revolved from a spline. Other
    constructions, with one closed surface or with poles at the ends of an ellipse, are read back wrong from STEP files.
    """
    middle, axis = cq.Vector(0.0, 0.0, 0.0), cq.Vector(0.0, 1.0, 0.0)
    half = cq.Edge.makeEllipse(across, radius, middle, cq.Vector(0.0, 0.0, -1.0), axis, 0.0, 180.0)
    if beyond_equator:
        half = half.toNURBS()
    outline = cq.Wire.assembleEdges([half, cq.Edge.makeLine(half.endPoint(), half.startPoint())])
    upper = cq.Solid.revolve(outline, [], -180.0, middle, axis)
    return upper.fuse(cq.Solid.revolve(outline, [], 180.0, middle, axis)) if beyond_equator else upper


def _outline(piece: cq.Shape, tips: Tips, x: float) -> cq.Face:
    """Return the face of the curved top of a piece that lies under the tip at x [mm]."""
    side = tips.side_mm
    far = piece.BoundingBox().DiagonalLength
    if tips.tip_shape.is_round:
        column = cq.Solid.makeCylinder(0.5 * side, 2.0 * far, cq.Vector(x, 0.0, -far))
    else:
        column = cq.Solid.makeBox(side, side, 2.0 * far, cq.Vector(x - 0.5 * side, -0.5 * side, -far))
    curved = [face for face in piece.Faces() if face.geomType() != "PLANE"]
    top = max(curved, key=lambda face: face.BoundingBox().zmax)
    return top.intersect(column).Faces()[0]
