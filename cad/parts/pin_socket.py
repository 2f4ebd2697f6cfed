"""Sockets: a pocket in the foot of each shuttle, and the ground steel pin that is glued into it.

A printed edge is round: 0.1 mm of it moves the force ratio by a tenth. A pin has the edges that its grinder gave it.
"""

import math
from dataclasses import dataclass

import cadquery as cq

from cad.checks.line_probe import SolidLines, Vector
from cad.design.parameters import Tips
from cad.parts.housing import Housing, named_housing
from cad.parts.part import Part
from cad.parts.tips import PLACE_TOLERANCE_MM, tip_parts
from cad.verdict import Verdict, equal, failed

STEEL_MPA = 206000.0  # typical of carbon steel
_SQUARE, _ROUND = 1.1523, 1.0  # F (1 - nu^2) / (E d side) of a rigid punch on a half-space, Read 1997, Sneddon 1965
_REACH = 1.0


@dataclass(frozen=True, kw_only=True)
class PinGive:
    """What a glued pin gives [mm/N]: the middle of its bounds and half of their distance."""

    compliance: float
    error: float


def pin_give(housing: Housing, E: float, poisson: float) -> PinGive:
    """Return how far a pin moves against the foot it is glued in; 0 for a printed tip.

    Bounds: the foot rigid, and the pin's end a punch on a half-space of it with no glue on its sides. The steel that
    stands out is a bar in compression; a ball at its end counts as a cylinder.
    """
    if not housing.pin_side:
        return PinGive(compliance=0.0, error=0.0)
    punch, area = (_ROUND, 0.25 * math.pi) if housing.pin_round else (_SQUARE, 1.0)
    soft = (1.0 - poisson**2) / (punch * E * housing.pin_side)
    bar = housing.pin_out / (STEEL_MPA * area * housing.pin_side**2)
    return PinGive(compliance=bar + 0.5 * soft, error=0.5 * soft)


def socketed(part: Part, housing: Housing) -> Part:
    """Return the housing with a pocket in each foot, closed above by a gable that prints without support."""
    if not housing.pin_side:
        return part
    half, deep = 0.5 * housing.pocket_side, housing.pocket_depth
    # In print pose the face y = -depth / 2 lies up: the gable points there.
    section = [(-half, half), (half, half), (half, -half), (0.0, -2.0 * half), (-half, -half)]
    tools = [
        cq.Workplane("XY", origin=(x, 0.0, -_REACH)).polyline(section).close().extrude(deep + _REACH).findSolid()
        for x in (-0.5 * housing.spacing, 0.5 * housing.spacing)
    ]
    return named_housing(part.shape.cut(*tools).Solids()[0], housing)


def pin_parts(housing: Housing, tips: Tips) -> tuple[Part, ...]:
    """Return the low and the high pin [mm] in their pockets, standing out to z = -pin_out; none for printed tips."""
    if not housing.pin_side:
        return ()
    down = cq.Vector(0.0, 0.0, -housing.pin_out)
    length = housing.pin_out + housing.pocket_depth
    return tuple(
        Part(name=part.name.replace("tip", "pin"), shape=part.shape.translate(down), faces=part.faces)
        for part in tip_parts(tips, length)
    )


def socket_findings(part: Part, housing: Housing, tips: Tips) -> tuple[Verdict, ...]:
    """Return geometry.sockets [mm]: how far a pocket is off its declared width and depth, measured by lines.

    A pin that cuts into its foot fails it. None for printed tips.
    """
    if not housing.pin_side:
        return ()
    name, lines, off = "geometry.sockets", SolidLines(part.shape), 0.0
    half, deep = 0.5 * housing.pocket_side, 0.5 * housing.pocket_depth
    for pin in pin_parts(housing, tips):
        middle: Vector = (pin.shape.Center().x, 0.0, deep)
        ways: tuple[tuple[Vector, float], ...] = (
            ((1.0, 0.0, 0.0), half), ((-1.0, 0.0, 0.0), half), ((0.0, 1.0, 0.0), half),
            ((0.0, -1.0, 0.0), 2.0 * half), ((0.0, 0.0, 1.0), deep),
        )  # fmt: skip
        found = [_open(lines, middle, way) - wide for way, wide in ways]
        if not all(math.isfinite(one) for one in found) or pin.shape.intersect(part.shape).Solids():
            return (failed(name, 0.0, unit="mm", reference=f"no pocket that holds the {pin.name}"),)
        off = max(off, *(abs(one) for one in found))
    size = f"side {housing.pocket_side:g}, depth {housing.pocket_depth:g} mm, pins of {housing.pin_side:g} mm"
    reference = f"lines from the middle of each pocket to its walls, end and gable: {size}"
    return (equal(name, off, 0.0, PLACE_TOLERANCE_MM, unit="mm", reference=reference),)


def _open(lines: SolidLines, start: Vector, way: Vector) -> float:
    """Return the open distance from a point to the first material [mm]; nan inside material, inf without any."""
    spans = lines.spans(start, way)
    if any(begin <= 0.0 <= end for begin, end in spans):
        return math.nan
    return min((begin for begin, _ in spans if begin > 0.0), default=math.inf)
