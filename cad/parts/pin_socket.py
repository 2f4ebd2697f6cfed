"""Sockets: a pocket in the foot of each shuttle, and the ground steel pin that is glued into it.

A printed edge is round: 0.1 mm of it moves the force ratio by a tenth. A pin has the edges that its grinder gave it.
"""

import math
from dataclasses import dataclass

import cadquery as cq

from cad.design.tips import Tips
from cad.parts.housing import Housing
from cad.parts.housing_solid import named_housing
from cad.parts.part import NEAR_MM, Part

STEEL_MPA, STEEL_G_PER_CM3 = 206000.0, 7.85  # typical of carbon steel
_SQUARE, _ROUND = 1.1523, 1.0  # F (1 - nu^2) / (E d side) of a rigid punch on a half-space, Read 1997, Sneddon 1965
_REACH = 1.0


@dataclass(frozen=True, kw_only=True)
class PinCompliance:
    """How far a glued pin moves against its foot under a force [mm/N]: middle and half distance of its bounds."""

    compliance: float
    error: float


def pin_compliance(housing: Housing, E: float, poisson: float) -> PinCompliance:
    """Return how far a pin moves against the foot it is glued in [mm/N, E in MPa]; 0 for a printed tip.

    Bounds: the foot rigid, and the pin's end a punch on a half-space of it with no glue on its sides. The steel that
    stands out is a bar in compression; a ball at its end counts as a cylinder.
    """
    if not housing.pin_side:
        return PinCompliance(compliance=0.0, error=0.0)
    punch, area = (_ROUND, 0.25 * math.pi) if housing.pin_round else (_SQUARE, 1.0)
    soft_foot = (1.0 - poisson**2) / (punch * E * housing.pin_side)
    bar = housing.pin_out / (STEEL_MPA * area * housing.pin_side**2)
    return PinCompliance(compliance=bar + 0.5 * soft_foot, error=0.5 * soft_foot)


def pin_mass(housing: Housing, density: float) -> float:
    """Return by how much a glued pin is heavier than what its pocket takes of the foot [mg from g/cm^3]; 0 without."""
    area = 0.25 * math.pi * housing.pin_side**2 if housing.pin_round else housing.pin_side**2
    return area * (STEEL_G_PER_CM3 * (housing.pin_out + housing.pocket_depth) - density * housing.pocket_depth)


def socketed(part: Part, housing: Housing) -> Part:
    """Return the housing with a pocket in each foot, closed above by a gable that prints without support."""
    if not housing.pin_side:
        return part
    half, height = 0.5 * housing.pocket_side, housing.pocket_depth + _REACH
    # In print pose the face y = -depth / 2 lies up: the gable points there.
    section = [(-half, half), (half, half), (half, -half), (0.0, -2.0 * half), (-half, -half)]
    below = [cq.Workplane("XY", origin=(arm.centre, 0.0, -_REACH)) for arm in housing.arms]
    pockets = [plane.polyline(section).close().extrude(height).findSolid() for plane in below]
    return named_housing(part.shape.cut(*pockets).Solids()[0], housing)


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
    if tips.shape == "cylinder":
        solid: cq.Solid = cq.Solid.makeCylinder(radius, height, origin, up)
    else:
        solid = cq.Solid.makeBox(side, side, height, cq.Vector(-radius, -radius, 0.0))
    if tips.fillet_mm == 0.0:
        return solid
    edges = [edge for edge in solid.Edges() if edge.BoundingBox().zmax < NEAR_MM]
    rounded: cq.Shape = solid.fillet(tips.fillet_mm, edges)
    return rounded
