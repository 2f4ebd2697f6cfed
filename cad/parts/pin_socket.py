"""Pin sockets: a pocket in the foot of each shuttle, and the ground steel pin that is glued into it.

Printed edges are rounded, and an edge radius of 0.1 mm changes the force ratio by 10 %. The edges of a ground pin are
sharp.
"""

from __future__ import annotations

import math

import cadquery as cq

from cad.parts.housing import Housing, Pin
from cad.parts.housing_solid import named_housing
from cad.parts.part import NEAR_MM, Part
from sensor.design.tips import Tips
from sensor.tips.tip_shape import Arc, TipShape

_MARGIN = 1.0  # extension of a cut beyond the face that it opens [mm]


def cut_pin_sockets(part: Part, housing: Housing) -> Part:
    """Cut a pocket for a pin into each foot of a housing. A housing without pins is not changed.

    The pocket is closed by a gable on the side that is up in print, because a gable needs no support.
    """
    if housing.pin is None:
        return part
    half_width = 0.5 * housing.pin.pocket_side
    eaves_y = gable_side(housing) * half_width  # y of the side of the square that carries the gable
    # The section of a pocket in x and y is a square with a gable of 45 degrees on the side that is up in print.
    section = [
        (-half_width, -eaves_y),
        (half_width, -eaves_y),
        (half_width, eaves_y),
        (0.0, 2.0 * eaves_y),  # the ridge
        (-half_width, eaves_y),
    ]
    shape = part.shape
    for arm in housing.arms:
        below_foot = cq.Workplane("XY", origin=(arm.centre, 0.0, -_MARGIN))
        pocket = below_foot.polyline(section).close().extrude(housing.pin.pocket_depth + _MARGIN)
        shape = shape.cut(pocket.findSolid())
    return named_housing(shape, housing)


def gable_side(housing: Housing) -> float:
    """Return the sign of y [1] on the side that is up in print, where the pockets have their gables."""
    return 1.0 if housing.back_to_back else -1.0


def pin_locations(housing: Housing) -> dict[str, cq.Location]:
    """Return the location of each pin in a plate [mm], by the name of the pin. There are none for printed tips."""
    if housing.pin is None:
        return {}
    end = -housing.pin.protruding_length
    return {f"{arm.name}_pin": cq.Location(cq.Vector(arm.centre, 0.0, end)) for arm in housing.arms}


def pin_solid(pin: Pin, tips: Tips) -> cq.Shape:
    """Return the solid of a pin [mm], with the face that touches the fruit at z = 0. All pins of a sensor are equal."""
    return tip_solid(tips.tip_shape, pin.length)


def tip_solid(shape: TipShape, height: float) -> cq.Shape:
    """Return the solid of a tip of at least this height [mm], with the face or point that touches the fruit at z = 0.

    Raises ValueError for a square tip whose flanks are slanted.
    """
    top = max(height, shape.height_mm + NEAR_MM)
    return _round_solid(shape, top) if shape.is_round else _square_solid(shape, top)


def _round_solid(shape: TipShape, top: float) -> cq.Shape:
    """Return the solid of a round tip up to z = `top` [mm], by revolving its meridian about the z axis.

    The points of the meridian have the coordinates r, the distance from the axis, and z.
    """
    outline = cq.Workplane("XZ").moveTo(0.0, 0.0)  # the meridian begins at the apex
    for segment in shape.meridian:
        if isinstance(segment, Arc):
            # CadQuery needs a third point on the arc. Its r is halfway between the ends of the arc. The circle of the
            # arc touches the plane z = 0, so the centre of the circle is at z = radius.
            middle_r = 0.5 * (segment.start.r + segment.end.r)
            middle_z = segment.radius - math.sqrt(segment.radius**2 - (middle_r - segment.centre_r) ** 2)
            outline = outline.threePointArc((middle_r, middle_z), segment.end)
        else:
            outline = outline.lineTo(*segment.end)
    side_r = 0.5 * shape.side_mm  # where the meridian ends
    # The side and the top of the tip, and a line along the axis, close the outline.
    solid: cq.Shape = outline.lineTo(side_r, top).lineTo(0.0, top).close().revolve().findSolid()
    return solid


def _square_solid(shape: TipShape, top: float) -> cq.Shape:
    """Return the solid of a square tip up to z = `top` [mm]: a box whose lower edges may be rounded.

    The meridian must be a flat face, with or without a quarter circle at its edge. Raises ValueError for any other
    meridian, for example the flank of a pyramid, because a box with fillets cannot represent it.
    """
    half_side = 0.5 * shape.side_mm
    solid: cq.Shape = cq.Solid.makeBox(2.0 * half_side, 2.0 * half_side, top, cq.Vector(-half_side, -half_side, 0.0))
    for segment in shape.meridian:
        # A quarter circle at the edge of a flat face ends at z = radius. Any other segment that rises is a flank.
        is_quarter_circle = isinstance(segment, Arc) and abs(segment.end.z - segment.radius) < NEAR_MM
        if not is_quarter_circle and segment.end.z > segment.start.z:
            msg = f"tip shape {shape.name!r}: a square tip must have a flat face. Its edges may be sharp or rounded."
            raise ValueError(msg)
        if isinstance(segment, Arc):
            lower_edges = [edge for edge in solid.Edges() if edge.BoundingBox().zmax < NEAR_MM]
            solid = cq.Solid(solid.wrapped).fillet(segment.radius, lower_edges)
    return solid
