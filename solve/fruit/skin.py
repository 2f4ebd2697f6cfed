"""How the skin of a curved fruit falls away from its apex: lengths in mm, x along the tips, y across."""

import numpy as np

from solve.arrays import Floats


def cap_gap(x: Floats, y: Floats, radius: float, radius_across: float) -> Floats:
    """Return how far [mm] a fruit with these radii along and across the tips falls below the plane at its apex.

    An ellipsoid whose height semi-axis is `radius`: a sphere where both radii are equal. Beyond it, infinity.
    """
    rest = 1.0 - (x / radius) ** 2 - y**2 / (radius * radius_across)
    return np.where(rest >= 0.0, radius * (1.0 - np.sqrt(np.maximum(rest, 0.0))), np.inf)


def cap_slope(x: float, y: float, radius: float, radius_across: float) -> tuple[float, float]:
    """Return how fast [1] such a fruit falls along x and along y; infinite from its rim on."""
    rest = 1.0 - (x / radius) ** 2 - y**2 / (radius * radius_across)
    if not rest > 0.0:
        return float(np.inf), float(np.inf)
    return float(x / radius / np.sqrt(rest)), float(y / radius_across / np.sqrt(rest))
