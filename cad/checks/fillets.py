"""Radius of the fillets at the leaf roots, measured along diagonals through a solid or a mesh."""

import math
from collections.abc import Mapping

from cad.checks.line_probe import Lines, Vector
from cad.parts.housing import Housing, Point, fillet_corners
from cad.verdict import Verdict, at_least

_TOLERANCE_MM = 0.02  # a chord of a mesh, 0.005 mm, moves the radius by 1 / (sqrt 2 - 1) of it
_INSIDE = 0.05  # [mm] behind the sharp corner, where there is material with or without a fillet
_DIAGONALS = tuple((x * math.sqrt(0.5), z * math.sqrt(0.5)) for x in (-1.0, 1.0) for z in (-1.0, 1.0))


def fillet_finding(housing: Housing, forms: Mapping[str, Lines]) -> Verdict:
    """Return geometry.fillets: the least radius [mm] found at the corners that the housing rounds.

    The forms stand in the sensor frame. A corner without a fillet counts as radius 0.
    """
    found = [
        (_radius(lines, corner, 0.03 * housing.depth), form, corner)
        for form, lines in forms.items()
        for corner in fillet_corners(housing)
    ]
    radius, form, (x, z) = min(found)
    place = f"least in the {form} at x = {x:.3f}, z = {z:.3f} mm"
    reference = f"diagonals through {len(fillet_corners(housing))} corners; {place}"
    return at_least("geometry.fillets", radius, housing.low.fillet, _TOLERANCE_MM, unit="mm", reference=reference)


def _radius(lines: Lines, corner: Point, y: float) -> float:
    """Return the radius [mm] of the arc that a diagonal meets where it leaves the material into the open quarter."""
    start: Vector = (corner[0], y, corner[1])
    spans = [span for x, z in _DIAGONALS for span in lines.spans(start, (x, 0.0, z))]
    exits = [end for begin, end in spans if begin < -_INSIDE < end]
    return max(0.0, min(exits, default=0.0)) / (math.sqrt(2.0) - 1.0)
