"""Pin sockets: a pocket in the foot of each shuttle, and the ground steel pin that is glued into it.

Printed edges are rounded, and a radius of 0.1 mm changes the force ratio by 10 %. The edges of a ground pin are exact.
"""

from __future__ import annotations

import math

import cadquery as cq

from cad.parts.housing import Housing, Pin
from cad.parts.housing_solid import named_housing
from cad.parts.part import NEAR_MM, Part
from sensor.design.tips import Tips
from sensor.tips.tip_shape import Arc, TipShape

_REACH = 1.0  # extension of a cut beyond the face that it opens [mm]


def cut_pin_sockets(part: Part, housing: Housing) -> Part:
    """Return the housing with a pocket in each foot, closed on top in print by a gable that needs no support.

    A housing without pins is returned unchanged.
    """
    if housing.pin is None:
        return part
    half = 0.5 * housing.pin.pocket_side
    eaves = gable_side(housing) * half
    # The section of a pocket in x, y: a square with a gable of 45 degrees on the side that is up in print.
    section = [(-half, -eaves), (half, -eaves), (half, eaves), (0.0, 2.0 * eaves), (-half, eaves)]
    shape = part.shape
    for arm in housing.arms:
        below_foot = cq.Workplane("XY", origin=(arm.centre, 0.0, -_REACH))
        pocket = below_foot.polyline(section).close().extrude(housing.pin.pocket_depth + _REACH)
        shape = shape.cut(pocket.findSolid())
    return named_housing(shape, housing)


def gable_side(housing: Housing) -> float:
    """Return the sign of y on the side that is up in print, to which the gables of pockets point [1]."""
    return 1.0 if housing.back_to_back else -1.0


def pin_places(housing: Housing) -> dict[str, cq.Location]:
    """Return by name the places of the pins in a plate [mm]; empty for printed tips."""
    if housing.pin is None:
        return {}
    end = -housing.pin.outside
    return {f"{arm.name}_pin": cq.Location(cq.Vector(arm.centre, 0.0, end)) for arm in housing.arms}


def pin_solid(pin: Pin, tips: Tips) -> cq.Shape:
    """Return one of the equal pins, with the face that touches the fruit at z = 0 [mm]."""
    return tip_solid(tips.tip_shape, pin.length)


def tip_solid(shape: TipShape, height: float) -> cq.Shape:
    """Return a tip of at least this height [mm], with the face or point that touches the fruit at z = 0.

    Raises ValueError for a square tip that `_square_solid` cannot draw.
    """
    top = max(height, shape.height_mm + NEAR_MM)
    return _round_solid(shape, top) if shape.is_round else _square_solid(shape, top)


def _round_solid(shape: TipShape, top: float) -> cq.Shape:
    """Return the body of revolution of the meridian of a round tip, up to z = `top` [mm]."""
    outline = cq.Workplane("XZ").moveTo(0.0, 0.0)
    for piece in shape.meridian:
        if isinstance(piece, Arc):
            middle = 0.5 * (piece.start.r + piece.end.r)
            level = piece.radius - math.sqrt(piece.radius**2 - (middle - piece.centre_r) ** 2)
            outline = outline.threePointArc((middle, level), piece.end)
        else:
            outline = outline.lineTo(*piece.end)
    rim = 0.5 * shape.side_mm
    solid: cq.Shape = outline.lineTo(rim, top).lineTo(0.0, top).close().revolve().findSolid()
    return solid


def _square_solid(shape: TipShape, top: float) -> cq.Shape:
    """Return a square tip up to z = `top` [mm]: a box whose lower edges are rounded by the arc of the meridian.

    The meridian must be a level face, with or without a quarter circle at its edge. Raises ValueError for any other
    one, such as the flank of a pyramid, because a fillet of a box cannot represent it.
    """
    half = 0.5 * shape.side_mm
    solid: cq.Shape = cq.Solid.makeBox(2.0 * half, 2.0 * half, top, cq.Vector(-half, -half, 0.0))
    for piece in shape.meridian:
        is_quarter = isinstance(piece, Arc) and abs(piece.end.z - piece.radius) < NEAR_MM
        if not is_quarter and piece.end.z > piece.start.z:
            msg = f"tip shape {shape.name!r}: a square tip has a flat face and perhaps a rounded edge."
            raise ValueError(msg)
        if isinstance(piece, Arc):
            edges = [edge for edge in solid.Edges() if edge.BoundingBox().zmax < NEAR_MM]
            solid = cq.Solid(solid.wrapped).fillet(piece.radius, edges)
    return solid
