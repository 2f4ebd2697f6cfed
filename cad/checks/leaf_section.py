"""Thickness of the leaves and radius of their fillets, measured by lines through a solid or a mesh."""

import itertools
import math
from collections.abc import Iterator, Mapping

from cad.checks.line_probe import Lines, Vector
from cad.parts.housing import Arm, Housing, Point, fillet_corners
from cad.verdict import Verdict, at_least, equal, failed

THICKNESS_TOLERANCE_MM = 1e-3  # a mesh file holds single precision, 4e-6 mm at 60 mm; the drawing rounds to 0.001
_ALONG = (0.02, 0.25, 0.5, 0.75, 0.98)  # shares of the straight part of a leaf
_BESIDE_MIDDLE = 0.03  # share of the depth, not on the plane of symmetry, where triangles share an edge
_ACROSS = (-0.42, _BESIDE_MIDDLE, 0.42)  # shares of the depth
_RADIUS_TOLERANCE_MM = 0.02  # a chord of a mesh, 0.005 mm, moves the radius by 1 / (sqrt 2 - 1) of it
_INSIDE = 0.05  # [mm] behind the sharp corner, where there is material with or without a fillet
_DIAGONALS = tuple((x * math.sqrt(0.5), z * math.sqrt(0.5)) for x in (-1.0, 1.0) for z in (-1.0, 1.0))


def leaf_thickness_verdicts(housing: Housing, forms: Mapping[str, Lines]) -> tuple[Verdict, ...]:
    """Return geometry.leaf_thickness_low and _high: the thickness [mm] farthest from the declared one.

    The forms (solid, STEP, STL) stand in the sensor frame; every one is measured at 15 places on each leaf.
    """
    return tuple(_leaf_thickness_verdict(housing, arm, forms) for arm in housing.arms)


def _leaf_thickness_verdict(housing: Housing, arm: Arm, forms: Mapping[str, Lines]) -> Verdict:
    name, declared = f"geometry.leaf_thickness_{arm.name}", arm.flexure.thickness
    worst, where = declared, ""
    for form, lines in forms.items():
        for x, y, z in _leaf_places(housing, arm):
            around = [end - start for start, end in lines.spans((x, y, z), (0.0, 0.0, 1.0)) if start < 0.0 < end]
            if not around:
                reference = f"no leaf at x = {x:.3f}, z = {z:.3f} mm in the {form}"
                return failed(name, declared, unit="mm", reference=reference)
            if abs(around[0] - declared) > abs(worst - declared):
                worst, where = around[0], f", farthest in the {form} at x = {x:.3f}, z = {z:.3f} mm"
    reference = f"lines through both leaves at 15 places each in {', '.join(forms)}{where}"
    return equal(name, worst, declared, THICKNESS_TOLERANCE_MM, unit="mm", reference=reference)


def _leaf_places(housing: Housing, arm: Arm) -> Iterator[Vector]:
    """Yield points [mm] on the middle planes of the straight parts of both leaves."""
    left, right = arm.roots
    start, end = left + arm.flexure.fillet, right - arm.flexure.fillet
    for level, along, across in itertools.product(arm.levels, _ALONG, _ACROSS):
        yield start + along * (end - start), across * housing.depth, level


def fillet_verdict(housing: Housing, forms: Mapping[str, Lines]) -> Verdict:
    """Return geometry.fillets: the least radius [mm] at the corners that the housing rounds.

    The forms stand in the sensor frame. A corner without a fillet counts as radius 0.
    """
    corners, limit = fillet_corners(housing), housing.low.fillet
    radius, form, (x, z) = min(
        (_radius(lines, corner, _BESIDE_MIDDLE * housing.depth), form, corner)
        for form, lines in forms.items()
        for corner in corners
    )
    reference = f"diagonals through {len(corners)} corners; least in the {form} at x = {x:.3f}, z = {z:.3f} mm"
    return at_least("geometry.fillets", radius, limit, _RADIUS_TOLERANCE_MM, unit="mm", reference=reference)


def _radius(lines: Lines, corner: Point, y: float) -> float:
    """Return the radius [mm] of the arc that a diagonal meets where it leaves the material into the open quarter."""
    start: Vector = (corner[0], y, corner[1])
    spans = [span for x, z in _DIAGONALS for span in lines.spans(start, (x, 0.0, z))]
    exits = [end for begin, end in spans if begin < -_INSIDE < end]
    return max(0.0, min(exits, default=0.0)) / (math.sqrt(2.0) - 1.0)
