"""A round block of flesh under a tip in rectangles that are small where the tip's edge bites, in tip sides."""

from dataclasses import dataclass

import numpy as np

from reference.flat_punch.tip_profile import RoundTip
from sensor.arrays import Floats, Ints

# The paper's block seen from its tip: 20 x 20 tip sides as a circle of equal area, 12 high. The force over the linear
# one is that of any larger body within 0.1 %.
BODY_RADIUS = 11.284
BODY_HEIGHT = 12.0
SHARP_SIZE = 0.025  # of the elements at a sharp edge [tip sides]
FILLET_ELEMENTS = 6  # at least, times the refinement
GROWTH = 1.8


@dataclass(frozen=True, kw_only=True, eq=False)
class Grid:
    """Lines r and z [tip sides] between rectangles; z falls from 0 at the top to the base.

    A node's number is its column times the nodes of a column plus its row.
    """

    r: Floats
    z: Floats

    @property
    def r_nodes(self) -> Floats:
        """Return the radii of the columns of nodes [tip sides]."""
        return _with_midpoints(self.r)

    @property
    def z_nodes(self) -> Floats:
        """Return the heights of the rows of nodes [tip sides], from 0 downwards."""
        return _with_midpoints(self.z)

    @property
    def nodes(self) -> Ints:
        """Return the nodes of each quadratic element, 3 x 3 with the radial index first, shape (elements, 9)."""
        rows = 2 * len(self.z) - 1
        corner = 2 * rows * np.arange(len(self.r) - 1)[:, None] + 2 * np.arange(len(self.z) - 1)
        local = rows * np.arange(3)[:, None] + np.arange(3)
        return corner.reshape(-1, 1) + local.reshape(1, -1)

    @property
    def top(self) -> Ints:
        """Return the nodes of the top, from the axis outwards."""
        return (2 * len(self.z) - 1) * np.arange(2 * len(self.r) - 1)


def press_grid(tip: RoundTip, refinement: int = 1) -> Grid:
    """Return the grid for a tip; twice the refinement halves the elements where the tip's edge bites."""
    if tip.edge > 0.0:
        count = fillet_elements(tip.edge, refinement)
        size = tip.edge / count
        fillet = np.linspace(tip.seat, tip.radius, count + 1)
        under_tip = np.concatenate([tip.seat - graded(size, tip.seat)[::-1], fillet[1:]])
    else:
        size = SHARP_SIZE / refinement
        under_tip = tip.radius - graded(size, tip.radius)[::-1]
    under_tip[0] = 0.0
    outside = tip.radius + graded(size, BODY_RADIUS - tip.radius)
    return Grid(r=np.concatenate([under_tip, outside[1:]]), z=-graded(size, BODY_HEIGHT))


def fillet_elements(edge: float, refinement: int = 1) -> int:
    """Return into how many elements a fillet of radius `edge` [tip sides] is divided [1]."""
    return max(FILLET_ELEMENTS * refinement, round(edge * refinement / SHARP_SIZE))


def graded(first: float, length: float) -> Floats:
    """Return lines from 0 to a length, the first step at most as given and each next one larger [same unit]."""
    ends = np.cumsum(first * GROWTH ** np.arange(200))
    count = int(np.searchsorted(ends, length)) + 1
    lines = np.concatenate([[0.0], ends[:count]])
    return np.asarray(lines * (length / lines[-1]))


def _with_midpoints(lines: Floats) -> Floats:
    points = np.empty(2 * len(lines) - 1)
    points[::2] = lines
    points[1::2] = 0.5 * (lines[1:] + lines[:-1])
    return points
