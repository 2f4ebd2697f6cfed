"""Verdicts on the tips of a housing: the places of printed tips, and the pockets that pins are glued into."""

import itertools
import math

import cadquery as cq

from cad.checks.line_probe import UP, Lines, open_ahead, solid_lines
from cad.parts.housing import Arm, Housing
from cad.parts.housing_solid import BALL_SHARE
from cad.parts.part import Part
from cad.parts.pin_socket import gable_side, pins
from sensor.design.tips import Tips
from sensor.verdict import Verdict, equal, failed_verdict

PLACE_TOLERANCE_MM = 1e-3
_ON_CAP = 0.6  # share of the half side at which a cap is measured along and across the tips


def tip_verdict(part: Part, housing: Housing) -> Verdict:
    """Return geometry.tips [mm]: how far an edge of a tip's face is off the declared side, spacing and level.

    On a dome lines at nine places measure its cap as well.
    """
    errors = []
    for arm in housing.arms:
        errors += _edge_errors(part, housing, arm)
        if housing.dome_radius:
            errors += _cap_errors(part, housing, arm)
    cap = f", caps of radius {housing.dome_radius:g} mm" if housing.dome_radius else ""
    reference = f"edges of both tip faces: side {housing.tip_side:g}, spacing {housing.spacing:g} mm, at z = 0{cap}"
    return equal("geometry.tips", max(errors), 0.0, PLACE_TOLERANCE_MM, unit="mm", reference=reference)


def _edge_errors(part: Part, housing: Housing, arm: Arm) -> list[float]:
    """Return how far the ends of a tip's face along x, y and z are off the declared ones [mm]."""
    half = 0.5 * housing.tip_side
    top = 0.0
    radius = housing.dome_radius
    if radius:
        # The face is the cap: it ends at the corners of the tip, or as a circle of half a ball inside the square.
        to_corner = min(radius, math.hypot(half, half))
        top = min(BALL_SHARE * radius, _cap_level(radius, to_corner))
        half = min(half, math.sqrt(top * (2.0 * radius - top)))  # radius of the cap at that level
    every = part.shape.Faces()
    box = cq.Compound.makeCompound([every[index] for index in part.faces[f"{arm.name}_tip"]]).BoundingBox()
    return [
        abs(box.xmin - (arm.centre - half)),
        abs(box.xmax - (arm.centre + half)),
        abs(box.ymin + half),
        abs(box.ymax - half),
        abs(box.zmin),
        abs(box.zmax - top),
    ]


def _cap_level(radius: float, from_axis: float) -> float:
    """Return the height of a cap [mm] at a distance from its axis [mm]."""
    return radius - math.sqrt(radius**2 - from_axis**2)


def _cap_errors(part: Part, housing: Housing, arm: Arm) -> list[float]:
    """Return how far a cap is off its sphere along the press [mm], at nine places of the round face."""
    lines = solid_lines(part.shape)
    step = _ON_CAP * min(0.5 * housing.tip_side, housing.dome_radius)
    errors = []
    for along, across in itertools.product((-step, 0.0, step), repeat=2):
        level = open_ahead(lines, (arm.centre + along, across, -1.0), UP) - 1.0
        errors.append(abs(level - _cap_level(housing.dome_radius, math.hypot(along, across))))
    return errors


def socket_verdicts(part: Part, housing: Housing, tips: Tips) -> tuple[Verdict, ...]:
    """Return geometry.sockets [mm]: how far a pocket is off its declared width and depth, measured by lines.

    A pin that cuts into its foot fails it. None for printed tips.
    """
    if not housing.pin_side:
        return ()
    name = "geometry.sockets"
    lines = solid_lines(part.shape)
    worst = 0.0
    for pin, shape in pins(housing, tips).items():
        error = _pocket_error(lines, housing, shape.Center().x)
        if not math.isfinite(error) or shape.intersect(part.shape).Solids():
            return (failed_verdict(name, 0.0, unit="mm", reference=f"no pocket that holds the {pin}"),)
        worst = max(worst, error)
    size = f"side {housing.pocket_side:g}, depth {housing.pocket_depth:g} mm, pins of {housing.pin_side:g} mm"
    reference = f"lines from the middle of each pocket to its walls, end and gable: {size}"
    return (equal(name, worst, 0.0, PLACE_TOLERANCE_MM, unit="mm", reference=reference),)


def _pocket_error(lines: Lines, housing: Housing, x: float) -> float:
    """Return by how much a pocket at x is too wide or too narrow on any side, its gable and its end [mm]."""
    half_width = 0.5 * housing.pocket_side
    half_depth = 0.5 * housing.pocket_depth
    gable = gable_side(housing)  # +1 or -1: on which side along y the pocket ends in a ridge of 45 degrees
    declared = {
        (1.0, 0.0, 0.0): half_width,
        (-1.0, 0.0, 0.0): half_width,
        (0.0, -gable, 0.0): half_width,
        (0.0, gable, 0.0): housing.pocket_side,  # the ridge is a whole side from the middle
        UP: half_depth,
    }
    middle = (x, 0.0, half_depth)
    errors = [abs(open_ahead(lines, middle, direction) - length) for direction, length in declared.items()]
    return math.nan if any(map(math.isnan, errors)) else max(errors)
