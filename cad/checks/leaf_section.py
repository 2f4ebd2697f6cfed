"""Verdicts on the leaf thickness, which is measured along vertical lines through a solid or a mesh."""

import itertools
from collections.abc import Mapping

from cad.checks.line_probe import UP, LineProbe, Vector
from cad.parts.housing import Arm, Housing
from sensor.verdict import Verdict, judge

THICKNESS_TOLERANCE_MM = 1e-3  # precision of the drawing; the single precision of a mesh file is finer, 4e-6 mm
_LENGTH_FRACTIONS = (0.02, 0.25, 0.5, 0.75, 0.98)  # measured points along a leaf, as fractions of its straight part
_BESIDE_MIDDLE = 0.03  # fraction of the depth; a line in the plane of symmetry would coincide with triangle edges
_DEPTH_FRACTIONS = (-0.42, _BESIDE_MIDDLE, 0.42)  # measured points from mid-depth, as fractions of the depth


def leaf_thickness_verdicts(housing: Housing, forms: Mapping[str, LineProbe]) -> tuple[Verdict, ...]:
    """Return geometry.leaf_thickness_low and _high: the measured thickness [mm] that deviates most from the design.

    `forms` holds a line probe for each form of the part: the solid, the STEP file and the STL file. The keys are the
    names of the forms, and all probes use sensor coordinates. Each leaf is measured at 15 points in every form.
    """
    return tuple(_leaf_thickness_verdict(housing, arm, forms) for arm in housing.arms)


def _leaf_thickness_verdict(housing: Housing, arm: Arm, forms: Mapping[str, LineProbe]) -> Verdict:
    """Return the verdict on the leaves of an arm: the thickness [mm] that deviates most from the design.

    `forms` holds a line probe for each form of the part, such as the STL file. The verdict fails if there is no
    material at a measured point. The reference text of the verdict gives the place of the largest deviation.
    """
    name = f"geometry.leaf_thickness_{arm.name}"
    nominal = arm.flexure.thickness
    worst_thickness = nominal
    worst_text = ""
    for form, point in itertools.product(forms, _leaf_points(housing, arm)):
        point_text = f"in the {form} at x = {point[0]:.3f}, z = {point[2]:.3f} mm"
        # Positions on the line are measured from the point, so the chord that contains 0 runs through the leaf.
        chords = [chord for chord in forms[form](point, UP) if chord.enter < 0.0 < chord.leave]
        if not chords:
            return judge(name, None, f"no leaf {point_text}", limit=nominal)
        thickness = chords[0].leave - chords[0].enter
        if abs(thickness - nominal) > abs(worst_thickness - nominal):
            worst_thickness = thickness
            worst_text = f", largest deviation {point_text}"
    # The 15 points of a leaf are at five positions along its length and three in depth.
    reference = f"lines through both leaves at 15 points each in {', '.join(forms)}{worst_text}"
    return judge(name, worst_thickness, reference, limit=nominal, tolerance=THICKNESS_TOLERANCE_MM)


def _leaf_points(housing: Housing, arm: Arm) -> list[Vector]:
    """Return points [mm] on the mid-planes of both leaves of an arm, in the straight parts between the fillets."""
    left, right = arm.roots
    start = left + arm.flexure.fillet
    straight_length = right - arm.flexure.fillet - start
    return [
        (start + length_fraction * straight_length, depth_fraction * housing.depth, level)
        for level, length_fraction, depth_fraction in itertools.product(arm.levels, _LENGTH_FRACTIONS, _DEPTH_FRACTIONS)
    ]
