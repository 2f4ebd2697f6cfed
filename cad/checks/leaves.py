"""Thickness of the leaves measured by lines through a solid or a mesh, against what the housing declares."""

from collections.abc import Iterator, Mapping

from cad.checks.line_probe import Lines, Vector
from cad.parts.housing import Housing
from cad.theory.flexure import Flexure
from cad.verdict import Verdict, equal, failed

THICKNESS_TOLERANCE_MM = 1e-3  # a mesh file holds single precision, 4e-6 mm at 60 mm; the drawing rounds to 0.001
_ALONG = (0.02, 0.25, 0.5, 0.75, 0.98)  # shares of the straight part of a leaf
_ACROSS = (-0.42, 0.03, 0.42)  # shares of the depth; none on a plane of symmetry, where triangles share an edge


def leaf_findings(housing: Housing, forms: Mapping[str, Lines]) -> tuple[Verdict, ...]:
    """Return geometry.leaf_thickness_low and _high: the thickness [mm] farthest from the declared one.

    The forms (solid, STEP, STL) stand in the sensor frame; every one is measured at 15 places on each leaf.
    """
    return tuple(_leaf_finding(housing, side, flexure, roots, forms) for side, flexure, roots in housing.arms)


def _leaf_finding(
    housing: Housing, side: str, flexure: Flexure, roots: tuple[float, float], forms: Mapping[str, Lines]
) -> Verdict:
    name = f"geometry.leaf_thickness_{side}"
    worst, where = flexure.thickness, ""
    for form, lines in forms.items():
        for place in leaf_places(housing, flexure, roots):
            thickness = _thickness(lines, place)
            if thickness is None:
                at = f"x = {place[0]:.3f}, z = {place[2]:.3f} mm"
                return failed(name, flexure.thickness, unit="mm", reference=f"no leaf at {at} in the {form}")
            if abs(thickness - flexure.thickness) > abs(worst - flexure.thickness):
                worst, where = thickness, f", farthest in the {form} at x = {place[0]:.3f}, z = {place[2]:.3f} mm"
    reference = f"lines through both leaves at 15 places each in {', '.join(forms)}{where}"
    return equal(name, worst, flexure.thickness, THICKNESS_TOLERANCE_MM, unit="mm", reference=reference)


def leaf_places(housing: Housing, flexure: Flexure, roots: tuple[float, float]) -> Iterator[Vector]:
    """Yield points [mm] on the middle planes of the straight parts of both leaves."""
    start, end = min(roots) + flexure.fillet, max(roots) - flexure.fillet
    for level in (housing.lower_leaf_level, housing.lower_leaf_level + flexure.separation):
        for along in _ALONG:
            for across in _ACROSS:
                yield start + along * (end - start), across * housing.depth, level


def _thickness(lines: Lines, place: Vector) -> float | None:
    """Return the length along z of the material around a point [mm], or None where the point is outside."""
    around = [end - start for start, end in lines.spans(place, (0.0, 0.0, 1.0)) if start < 0.0 < end]
    return around[0] if around else None
