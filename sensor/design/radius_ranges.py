"""The ranges of the principal radii of a design's fruit, and whether a fruit lies within them."""

from collections.abc import Iterator, Sequence

from sensor.design.parameters import Design
from sensor.design.reading import ReadingRequirements

FLAT_RADIUS = 1e9
"""Radius that represents a flat fruit [mm]."""
_RANGE_TOLERANCE = 1e-9  # relative tolerance at the ends of a range

Vector = tuple[float, float]


def radii_beyond_design(radii: Vector, design: Design) -> Iterator[str]:
    """Yield a note for each principal radius of a fruit [mm] that lies outside the range of a design."""
    radius_ranges = _radius_ranges(design)
    names = ("radius", "radius across")
    for name, radius, radius_range in zip(names, _order_radii(radii, radius_ranges), radius_ranges, strict=True):
        yield from outside_range(name, radius, radius_range, "mm")


def outside_range(name: str, value: float, ends: Vector, unit: str) -> Iterator[str]:
    """Yield a note if a value lies outside a range of the design, whose two `ends` have the same unit."""
    low, high = ends
    if not low * (1.0 - _RANGE_TOLERANCE) <= value <= high * (1.0 + _RANGE_TOLERANCE):
        yield f"{name} {value:.4g} {unit} is outside {low:.4g} to {high:.4g} {unit}, the range of the design"


def _radius_ranges(design: Design) -> Sequence[Vector]:
    """Return the two ends of the range of each principal radius of a design's fruit [mm].

    Without stated ranges, the radii of the fruit vary by the stated spread, which is relative.
    """
    reading = design.reading or ReadingRequirements()
    if reading.radius_mm is not None and reading.radius_across_mm is not None:
        return [reading.radius_mm, reading.radius_across_mm]
    smallest_factor, largest_factor = 1.0 - reading.radius_spread, 1.0 + reading.radius_spread
    return [(smallest_factor * radius, largest_factor * radius) for radius in designed_radii(design)]


def _order_radii(radii: Vector, radius_ranges: Sequence[Vector]) -> Vector:
    """Return the two `radii` [mm] in the order in which more of them lie within their ranges.

    The order of the radii of a fruit is arbitrary. `radius_ranges` holds the two ends of the range of each radius [mm].
    """

    def count_in_range(ordered: Vector) -> int:
        return sum(low <= radius <= high for radius, (low, high) in zip(ordered, radius_ranges, strict=True))

    reversed_radii = radii[::-1]
    return reversed_radii if count_in_range(reversed_radii) > count_in_range(radii) else radii


def designed_radii(design: Design) -> Vector:
    """Return the principal radii of the design's fruit [mm]; a flat fruit has very large but finite radii."""
    first, second = design.fruit.radii_mm
    return min(first, FLAT_RADIUS), min(second, FLAT_RADIUS)
