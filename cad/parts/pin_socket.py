"""Sockets: a pocket in the foot of each shuttle, and the ground steel pin that is glued into it.

A printed edge is round: 0.1 mm of it moves the force ratio by a tenth. A pin has the edges that its grinder gave it.
"""

from __future__ import annotations

import math

import cadquery as cq

from cad.design.tips import Tips
from cad.parts.housing import Housing
from cad.parts.housing_solid import named_housing
from cad.parts.part import NEAR_MM, Part

_REACH = 1.0


def socketed(part: Part, housing: Housing) -> Part:
    """Return the housing with a pocket in each foot, closed above by a gable that prints without support."""
    if not housing.pin_side:
        return part
    half, height = 0.5 * housing.pocket_side, housing.pocket_depth + _REACH
    up = gable_side(housing)
    section = [(-half, -up * half), (half, -up * half), (half, up * half), (0.0, up * 2.0 * half), (-half, up * half)]
    below = [cq.Workplane("XY", origin=(arm.centre, 0.0, -_REACH)) for arm in housing.arms]
    pockets = [plane.polyline(section).close().extrude(height).findSolid() for plane in below]
    return named_housing(part.shape.cut(*pockets).Solids()[0], housing)


def gable_side(housing: Housing) -> float:
    """Return the sign [1] of the side y that lies up in print, to which the gable of a pocket points."""
    return 1.0 if housing.back_to_back else -1.0


def pins(housing: Housing, tips: Tips) -> dict[str, cq.Shape]:
    """Return by name the pins [mm] in their pockets, standing out to z = -pin_out; none for printed tips."""
    if not housing.pin_side:
        return {}
    out, pin = housing.pin_out, tip_solid(tips, housing.pin_out + housing.pocket_depth)
    return {f"{arm.name} pin": pin.translate(cq.Vector(arm.centre, 0.0, -out)) for arm in housing.arms}


def tip_solid(tips: Tips, height: float) -> cq.Shape:
    """Return a tip [mm] that stands on z = 0 with the face, or the cap, that touches."""
    side, origin, up = tips.side_mm, cq.Vector(0.0, 0.0, 0.0), cq.Vector(0.0, 0.0, 1.0)
    radius = 0.5 * side
    if tips.shape == "sphere":
        middle = cq.Vector(0.0, 0.0, radius)
        ball = cq.Solid.makeSphere(radius, middle, up, -90.0, 0.0, 360.0)
        return ball.fuse(cq.Solid.makeCylinder(radius, max(height - radius, NEAR_MM), middle, up)).Solids()[0]
    if tips.dome_radius_mm:
        return _dome_on_cylinder(radius, tips.dome_radius_mm, height)
    if tips.shape == "cylinder":
        solid: cq.Solid = cq.Solid.makeCylinder(radius, height, origin, up)
    else:
        solid = cq.Solid.makeBox(side, side, height, cq.Vector(-radius, -radius, 0.0))
    if tips.fillet_mm == 0.0:
        return solid
    edges = [edge for edge in solid.Edges() if edge.BoundingBox().zmax < NEAR_MM]
    rounded: cq.Shape = solid.fillet(tips.fillet_mm, edges)
    return rounded


def _dome_on_cylinder(radius: float, dome: float, height: float) -> cq.Shape:
    """Return a cylinder [mm] that stands on a cap of the dome's radius."""
    cap = dome - math.sqrt(dome**2 - radius**2)
    up, away = cq.Vector(0.0, 0.0, 1.0), 2.0 * radius
    around = cq.Solid.makeCylinder(away, cap + _REACH, cq.Vector(0.0, 0.0, -_REACH), up)
    ball = cq.Solid.makeSphere(dome, cq.Vector(0.0, 0.0, dome), up, -90.0, 90.0, 360.0)
    return cq.Solid.makeCylinder(radius, height, cq.Vector(0.0, 0.0, 0.0), up).cut(around.cut(ball)).Solids()[0]
