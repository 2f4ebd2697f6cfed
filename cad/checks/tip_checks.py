"""Verdicts on the tips of a housing: the places of printed tips, and the pockets that pins are glued into."""

import itertools
import math
from collections.abc import Iterator

import cadquery as cq

from cad.checks.line_probe import SolidLines, Vector
from cad.design.tips import Tips
from cad.parts.housing import Arm, Housing
from cad.parts.housing_solid import BALL_SHARE
from cad.parts.part import Part
from cad.parts.pin_socket import gable_side, pins
from cad.verdict import Verdict, equal, failed

PLACE_TOLERANCE_MM = 1e-3
_ON_CAP = 0.6  # share of the half side at which a cap is measured along and across the tips


def tip_verdict(part: Part, housing: Housing) -> Verdict:
    """Return geometry.tips [mm]: how far an edge of a tip's face is off the declared side, spacing and level.

    On a dome lines at nine places measure its cap as well.
    """
    off, radius, lines = 0.0, housing.dome_radius, SolidLines(part.shape)
    for arm in housing.arms:
        off = max(off, *_edge_errors(part, housing, arm))
        if radius:
            off = max(off, *_cap_errors(lines, housing, arm.centre))
    cap = f", caps of radius {radius:g} mm" if radius else ""
    reference = f"edges of both tip faces: side {housing.tip_side:g}, spacing {housing.spacing:g} mm, at z = 0{cap}"
    return equal("geometry.tips", off, 0.0, PLACE_TOLERANCE_MM, unit="mm", reference=reference)


def _edge_errors(part: Part, housing: Housing, arm: Arm) -> list[float]:
    """Return how far the ends of a tip's face along x, y and z are off the declared ones [mm]."""
    half, every, radius = 0.5 * housing.tip_side, part.shape.Faces(), housing.dome_radius
    top = min(BALL_SHARE * radius, _cap_level(radius, min(radius, math.sqrt(2.0) * half)))
    if radius:
        half = min(half, math.sqrt(top * (2.0 * radius - top)))
    box = cq.Compound.makeCompound([every[i] for i in part.faces[f"{arm.name}_tip"]]).BoundingBox()
    measured = (box.xmin, box.xmax, box.ymin, box.ymax, box.zmin, box.zmax)
    declared = (arm.centre - half, arm.centre + half, -half, half, 0.0, top)
    return [abs(a - b) for a, b in zip(measured, declared, strict=True)]


def _cap_level(radius: float, away: float) -> float:
    """Return the height of a cap [mm] at a distance from its axis [mm]; 0 for a flat face."""
    return radius - math.sqrt(radius**2 - away**2)


def _cap_errors(lines: SolidLines, housing: Housing, x: float) -> Iterator[float]:
    """Yield how far a cap at x is off its sphere along the press [mm], at nine places of the round face."""
    step = _ON_CAP * min(0.5 * housing.tip_side, housing.dome_radius)
    for along, across in itertools.product((-step, 0.0, step), repeat=2):
        declared = _cap_level(housing.dome_radius, math.hypot(along, across))
        yield abs(_open(lines, (x + along, across, -1.0), (0.0, 0.0, 1.0)) - 1.0 - declared)


def socket_verdicts(part: Part, housing: Housing, tips: Tips) -> tuple[Verdict, ...]:
    """Return geometry.sockets [mm]: how far a pocket is off its declared width and depth, measured by lines.

    A pin that cuts into its foot fails it. None for printed tips.
    """
    if not housing.pin_side:
        return ()
    name, lines, off = "geometry.sockets", SolidLines(part.shape), 0.0
    for pin, shape in pins(housing, tips).items():
        errors = _pocket_errors(lines, housing, shape.Center().x)
        if not all(map(math.isfinite, errors)) or shape.intersect(part.shape).Solids():
            return (failed(name, 0.0, unit="mm", reference=f"no pocket that holds the {pin}"),)
        off = max(off, *map(abs, errors))
    size = f"side {housing.pocket_side:g}, depth {housing.pocket_depth:g} mm, pins of {housing.pin_side:g} mm"
    reference = f"lines from the middle of each pocket to its walls, end and gable: {size}"
    return (equal(name, off, 0.0, PLACE_TOLERANCE_MM, unit="mm", reference=reference),)


def _pocket_errors(lines: SolidLines, housing: Housing, x: float) -> list[float]:
    """Return by how much a pocket at x is too wide to each side, to its gable and to its end [mm]."""
    half, deep, up = 0.5 * housing.pocket_side, 0.5 * housing.pocket_depth, gable_side(housing)
    middle = (x, 0.0, deep)
    return [
        _open(lines, middle, (1.0, 0.0, 0.0)) - half,
        _open(lines, middle, (-1.0, 0.0, 0.0)) - half,
        _open(lines, middle, (0.0, -up, 0.0)) - half,
        _open(lines, middle, (0.0, up, 0.0)) - 2.0 * half,
        _open(lines, middle, (0.0, 0.0, 1.0)) - deep,
    ]


def _open(lines: SolidLines, start: Vector, way: Vector) -> float:
    """Return the open distance from a point to the first material [mm]; nan inside material, inf without any."""
    spans = lines.spans(start, way)
    if any(begin <= 0.0 <= end for begin, end in spans):
        return math.nan
    return min((begin for begin, _ in spans if begin > 0.0), default=math.inf)
