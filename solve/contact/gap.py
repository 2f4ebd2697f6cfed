"""Gap between a rigid tip and the fruit before they deform, over the tip's own axes: lengths in mm, gap >= 0.

Every function takes coordinates of one shape, x along the tips, y across, from the centre of the tip (of the apex for
the fruit); infinity where the tip has no face. Gaps of tip and fruit add up.
"""

import numpy as np

from solve.arrays import Floats
from solve.fruit.skin import cap_gap


def cube_gap(x: Floats, y: Floats, side: float, fillet: float = 0.0) -> Floats:
    """Return the gap [mm] of a flat square face, its edges rounded by a quarter circle of radius `fillet` [mm]."""
    inside = 0.5 * side - np.maximum(np.abs(x), np.abs(y))
    return _rounded(inside, fillet)


def cylinder_gap(x: Floats, y: Floats, diameter: float, fillet: float = 0.0) -> Floats:
    """Return the gap [mm] of a flat circular face with an edge rounded by `fillet` [mm]."""
    return _rounded(0.5 * diameter - np.hypot(x, y), fillet)


def sphere_gap(x: Floats, y: Floats, radius: float) -> Floats:
    """Return the gap [mm] of a sphere above the plane that touches it."""
    return cap_gap(x, y, radius, radius)


def dome_gap(x: Floats, y: Floats, diameter: float, radius: float) -> Floats:
    """Return the gap [mm] of a cap of a sphere of a radius over a round face of a diameter [mm]."""
    return np.where(np.hypot(x, y) <= 0.5 * diameter, sphere_gap(x, y, radius), np.inf)


def _rounded(inside: Floats, fillet: float) -> Floats:
    """Return the gap at a distance `inside` from the edge of a face."""
    into = np.clip(fillet - inside, 0.0, fillet)
    return np.where(inside >= 0.0, fillet - np.sqrt(fillet**2 - into**2), np.inf)
