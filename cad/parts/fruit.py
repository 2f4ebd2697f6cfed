"""The solid of a fruit: a block, or part of a sphere or an ellipsoid, with the outlines of the tips on its top.

The x axis runs along the tips and the y axis across them. The z axis is opposite to the direction of the press. The
origin is the apex of a curved fruit, or the centre of the top face of a block. All lengths are in mm.
"""

from __future__ import annotations

import cadquery as cq

from sensor.design.fruit import Fruit
from sensor.design.tips import Tips


def whole_fruit(fruit: Fruit, tips: Tips) -> cq.Shape:
    """Return the solid of a fruit [mm].

    If there are two tips, the top face is split along their outlines, so that a mesh conforms to them. With any other
    number of tips, the top face remains whole.
    """
    body = outer_box(fruit) if fruit.radius_mm is None else _curved_piece(fruit, fruit.radius_mm)
    if not tips.tip_layout.is_pair:
        return body
    if fruit.radius_mm is None:
        outlines = [footprint(tips, x) for x in tips.centres_mm]
    else:
        outlines = [_outline(body, tips, x) for x in tips.centres_mm]
    return body.split(*outlines).Solids()[0]


def footprint(tips: Tips, x: float) -> cq.Face:
    """Return the outline of a tip centred at `x` [mm], a square or a circle, as a face in the plane z = 0.

    A circle consists of four arcs, so that a mesh has nodes at its extreme points in x and y.
    """
    centre = cq.Vector(x, 0.0, 0.0)
    if not tips.tip_shape.is_round:
        return cq.Face.makePlane(tips.side_mm, tips.side_mm, centre)
    up = cq.Vector(0.0, 0.0, 1.0)
    arcs = [cq.Edge.makeCircle(0.5 * tips.side_mm, centre, up, start, start + 90.0) for start in (0, 90, 180, 270)]
    return cq.Face.makeFromWires(cq.Wire.assembleEdges(arcs))


def outer_box(fruit: Fruit, top: float = 0.0) -> cq.Solid:
    """Return the box with the length and the width of a fruit, from its depth below z = 0 up to z = `top` [mm]."""
    corner = cq.Vector(-0.5 * fruit.length_mm, -0.5 * fruit.width_mm, -fruit.depth_mm)
    return cq.Solid.makeBox(fruit.length_mm, fruit.width_mm, fruit.depth_mm + top, corner)


def _curved_piece(fruit: Fruit, radius: float) -> cq.Solid:
    """Return the solid of a curved fruit, a sphere or an ellipsoid within its box, with the apex at the origin.

    `radius` [mm] is its radius along the tips. The surface is oriented so that its poles and its seam are away from the
    top, which is split along the outlines of the tips.
    """
    if fruit.radius_across_mm is None:
        sphere: cq.Shape = cq.Solid.makeSphere(radius, angleDegrees1=-90, angleDegrees2=90)
        # The poles of a new sphere are on the z axis. After the rotation, they are on the x axis.
        solid = sphere.rotate(cq.Vector(0.0, 0.0, 0.0), cq.Vector(0.0, 1.0, 0.0), 90.0)
    else:
        half_width = (radius * fruit.radius_across_mm) ** 0.5  # semi-axis b from the radius of curvature b^2 / radius
        # The fruit is cut at its depth below the apex, so only a deep fruit needs the lower half of the ellipsoid.
        solid = _ellipsoid(radius, half_width, beyond_equator=fruit.depth_mm > radius)
    lowered = solid.translate(cq.Vector(0.0, 0.0, -radius))  # from the centre to the apex
    if fruit.azimuth_deg:
        lowered = lowered.rotate(cq.Vector(0.0, 0.0, 0.0), cq.Vector(0.0, 0.0, 1.0), fruit.azimuth_deg)
    return lowered.intersect(outer_box(fruit, top=fruit.depth_mm)).Solids()[0]


def _ellipsoid(radius: float, semi_axis_y: float, *, beyond_equator: bool) -> cq.Shape:
    """Return the upper half of an ellipsoid centred on the origin [mm], or the whole ellipsoid if `beyond_equator`.

    The semi-axes are `radius` in x and z, and `semi_axis_y` in y. Half an ellipse in the plane z = 0 is revolved by 180
    degrees about the y axis. For the whole ellipsoid, the ellipse is a spline, and is revolved in both directions.
    Other constructions, with one closed surface or with poles at the ends of an ellipse, are read back incorrectly from
    STEP files.
    """
    centre, axis = cq.Vector(0.0, 0.0, 0.0), cq.Vector(0.0, 1.0, 0.0)
    half_ellipse = cq.Edge.makeEllipse(semi_axis_y, radius, centre, cq.Vector(0.0, 0.0, -1.0), axis, 0.0, 180.0)
    if beyond_equator:
        half_ellipse = half_ellipse.toNURBS()
    diameter = cq.Edge.makeLine(half_ellipse.endPoint(), half_ellipse.startPoint())
    outline = cq.Wire.assembleEdges([half_ellipse, diameter])
    upper_half = cq.Solid.revolve(outline, [], -180.0, centre, axis)
    if not beyond_equator:
        return upper_half
    lower_half = cq.Solid.revolve(outline, [], 180.0, centre, axis)
    return upper_half.fuse(lower_half)


def _outline(fruit: cq.Shape, tips: Tips, x: float) -> cq.Face:
    """Return the face on the curved top of a fruit that lies under the tip at `x` [mm].

    The face is the intersection of the top face of the `fruit` with a vertical column that has the outline of the tip.
    """
    side = tips.side_mm
    half_height = fruit.BoundingBox().DiagonalLength  # the column extends this distance above and below z = 0
    if tips.tip_shape.is_round:
        column = cq.Solid.makeCylinder(0.5 * side, 2.0 * half_height, cq.Vector(x, 0.0, -half_height))
    else:
        column = cq.Solid.makeBox(side, side, 2.0 * half_height, cq.Vector(x - 0.5 * side, -0.5 * side, -half_height))
    # An ellipsoid that extends beyond its equator has a second curved face below it.
    curved_faces = [face for face in fruit.Faces() if face.geomType() != "PLANE"]
    top = max(curved_faces, key=lambda face: face.BoundingBox().zmax)
    return top.intersect(column).Faces()[0]  # the intersection is a compound of one face
