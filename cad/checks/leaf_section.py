"""Thickness of the leaves, measured along vertical lines through a solid or a mesh."""

import itertools
from collections.abc import Mapping

from cad.checks.line_probe import UP, Lines, Vector
from cad.parts.housing import Arm, Housing
from sensor.verdict import Verdict, judge

THICKNESS_TOLERANCE_MM = 1e-3  # a mesh file holds single precision, 4e-6 mm at 60 mm; the drawing rounds to 0.001
_ALONG = (0.02, 0.25, 0.5, 0.75, 0.98)  # shares of the straight part of a leaf
_BESIDE_MIDDLE = 0.03  # share of the depth; a line in the plane of symmetry would run along edges of triangles
_ACROSS = (-0.42, _BESIDE_MIDDLE, 0.42)  # shares of the depth, from its middle; two lie near the faces


def leaf_thickness_verdicts(housing: Housing, forms: Mapping[str, Lines]) -> tuple[Verdict, ...]:
    """Return geometry.leaf_thickness_low and _high: the measured thickness [mm] that differs most from the design.

    `forms` are the lines through the solid, the STEP and the STL, all in the sensor frame. Each leaf is measured at 15
    places in every form.
    """
    return tuple(_leaf_thickness_verdict(housing, arm, forms) for arm in housing.arms)


def _leaf_thickness_verdict(housing: Housing, arm: Arm, forms: Mapping[str, Lines]) -> Verdict:
    """Return the verdict on both leaves of an arm, which fails if a line meets no leaf."""
    name = f"geometry.leaf_thickness_{arm.name}"
    declared = arm.flexure.thickness
    worst = declared
    place = ""
    for form, point in itertools.product(forms, _leaf_points(housing, arm)):
        here = f"in the {form} at x = {point[0]:.3f}, z = {point[2]:.3f} mm"
        leaves = [span for span in forms[form](point, UP) if span.enter < 0.0 < span.leave]
        if not leaves:
            return judge(name, None, f"no leaf {here}", limit=declared)
        thickness = leaves[0].leave - leaves[0].enter
        if abs(thickness - declared) > abs(worst - declared):
            worst = thickness
            place = f", farthest {here}"
    reference = f"lines through both leaves at 15 places each in {', '.join(forms)}{place}"
    return judge(name, worst, reference, limit=declared, tolerance=THICKNESS_TOLERANCE_MM)


def _leaf_points(housing: Housing, arm: Arm) -> list[Vector]:
    """Return points [mm] on the middle planes of both leaves, in their straight parts between the fillets."""
    left, right = arm.roots
    start = left + arm.flexure.fillet
    straight = right - arm.flexure.fillet - start
    return [
        (start + along * straight, across * housing.depth, level)
        for level, along, across in itertools.product(arm.levels, _ALONG, _ACROSS)
    ]
