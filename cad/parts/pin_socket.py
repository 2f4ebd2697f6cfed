"""Sockets: a pocket in the foot of each shuttle, and the ground steel pin that is glued into it.

A printed edge is round: 0.1 mm of it moves the force ratio by a tenth. A pin has the edges that its grinder gave it.
"""

from __future__ import annotations

import math

import cadquery as cq

from cad.parts.housing import Housing, Pin
from cad.parts.housing_solid import named_housing
from cad.parts.part import NEAR_MM, Part
from sensor.design.tips import Tips
from sensor.tips.tip_shape import Arc, TipShape

_REACH = 1.0  # [mm] of a cut beyond the face that it opens


def cut_pin_sockets(part: Part, housing: Housing) -> Part:
    """Return the housing with a pocket in each foot, closed above by a gable that prints without support.

    A housing without pins is returned as it is.
    """
    if housing.pin is None:
        return part
    half = 0.5 * housing.pin.pocket_side
    eaves = gable_side(housing) * half
    # The section across the press (x, y): a square, and on the side that lies up in print a ridge of 45 degrees.
    section = [(-half, -eaves), (half, -eaves), (half, eaves), (0.0, 2.0 * eaves), (-half, eaves)]
    shape = part.shape
    for arm in housing.arms:
        below_foot = cq.Workplane("XY", origin=(arm.centre, 0.0, -_REACH))
        pocket = below_foot.polyline(section).close().extrude(housing.pin.pocket_depth + _REACH)
        shape = shape.cut(pocket.findSolid())
    return named_housing(shape, housing)


def gable_side(housing: Housing) -> float:
    """Return the sign [1] of the side y that lies up in print, to which the gable of a pocket points."""
    return 1.0 if housing.back_to_back else -1.0


def pin_places(housing: Housing) -> dict[str, cq.Location]:
    """Return by name the places of the pins in a plate [mm], standing out of their feet; none for printed tips."""
    if housing.pin is None:
        return {}
    end = -housing.pin.outside
    return {f"{arm.name}_pin": cq.Location(cq.Vector(arm.centre, 0.0, end)) for arm in housing.arms}


def pin_solid(pin: Pin, tips: Tips) -> cq.Shape:
    """Return one of the pins, which are all equal, standing on its touching face at z = 0 [mm]."""
    return tip_solid(tips.tip_shape, pin.length)


def tip_solid(shape: TipShape, height: float) -> cq.Shape:
    """Return a tip [mm] that stands on z = 0 with the face, or the point, that touches, and is at least so high.

    Raises ValueError for a square tip that `_square_solid` cannot draw.
    """
    top = max(height, shape.height_mm + NEAR_MM)
    return _round_solid(shape, top) if shape.is_round else _square_solid(shape, top)


def _round_solid(shape: TipShape, top: float) -> cq.Shape:
    """Return the body that the meridian of a round tip leaves when it turns about the axis, up to z = `top` [mm]."""
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
    """Return a box whose lower edges are rounded by the radius of the meridian's arc, up to z = `top` [mm].

    That is the tip where the meridian is a level face with, at most, a quarter circle at its edge. Raises ValueError
    for any other one, such as the flank of a pyramid: no fillet of a box draws it.
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
