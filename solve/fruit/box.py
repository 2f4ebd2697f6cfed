"""A box of hexahedra with graded lines and named faces.

A tensor-product box needs no mesher: its lines follow the loads of the scene, keep mirror symmetry to rounding and
cost milliseconds; the fields of a fruit of any shape stay with the meshes of `mesh`.
"""

import itertools
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
from skfem import MeshHex

from solve.arrays import Flags, Floats

Lines = tuple[Floats, Floats, Floats]  # rising coordinates along x, y and z [mm]

SAMPLES = 2000
UP = 2
# Watched by tests/fits/block_mesh.py.
# Found by halving steps: reach of the clamp of a slender column [widths], of a low block's loads [heights], and
# the share of the distance to the image below the base that a step along z may take account of.
SLENDER = 0.4
SCREENED = 2.5
DEPTH = 0.6
COARSER = 0.75


def graded_line(start: float, end: float, size: Callable[[Floats], Floats], share: float = 1.0) -> Floats:
    """Return the fewest coordinates from start to end [mm] whose steps stay near size(coordinate) [mm].

    `share` < 1 takes that share of the steps instead, rounded down, as the coarser partner of the same line.
    """
    fine = np.linspace(start, end, SAMPLES + 1)
    density = 1.0 / size(0.5 * (fine[1:] + fine[:-1]))
    count = np.concatenate([[0.0], np.cumsum(density)]) * (end - start) / SAMPLES
    # the margin keeps the count the same for a scaled or mirrored box, whose sums differ by rounding
    elements = max(1, int(share * np.ceil(count[-1] - 1e-6)))
    line = np.interp(np.linspace(0.0, count[-1], elements + 1), count, fine)
    line[0], line[-1] = start, end
    return line


def box_mesh(lines: Lines) -> MeshHex:
    """Return the box over three rising lines [mm], z down: faces x_low, x_high, y_low, y_high, top (low z) and base."""
    mesh = MeshHex.init_tensor(*lines)
    names = (("x_low", "x_high"), ("y_low", "y_high"), ("top", "base"))
    faces = {}
    for axis, pair in enumerate(names):
        for name, place in zip(pair, (lines[axis][0], lines[axis][-1]), strict=True):
            reach = 1e-9 * (lines[axis][-1] - lines[axis][0])
            faces[name] = partial(_on_plane, axis=axis, place=place, reach=reach)
    return mesh.with_boundaries(faces)


def _on_plane(x: Floats, *, axis: int, place: float, reach: float) -> Flags:
    near: Flags = np.abs(x[axis] - place) <= reach
    return near


@dataclass(frozen=True)
class Grading:
    """How fine a block is divided: step over the distance to the nearest image load, and cells of the edge layer.

    `layer` are the parts, adding up to 1, into which the step next to the base and to each free side is cut.
    """

    step: float
    layer: tuple[float, ...]
    share: float = 1.0

    def coarser(self) -> "Grading":
        """Return the grading with fewer steps along every line and one cell less in the layer."""
        return Grading(self.step, (*self.layer[:-2], self.layer[-2] + self.layer[-1]), COARSER)


def block_lines(
    extent: tuple[float, float, float], points: Floats, mirrored: tuple[bool, bool], grading: Grading
) -> Lines:
    """Return lines [mm] along x, y and z for the smooth remainder of loads on a block's top.

    `extent` is length, width and height, the block lies at |x| <= length/2, |y| <= width/2, 0 <= z <= height;
    `points` (n, 2) are places of the loads; a mirrored axis begins at 0. The remainder looks like the field of the
    loads' images behind the faces, so a step may be as large as its distance to the nearest image allows.
    """
    lines = []
    for axis in range(3):
        start = 0.0 if axis == UP or mirrored[axis] else -0.5 * extent[axis]
        end = extent[axis] if axis == UP else 0.5 * extent[axis]
        size = partial(_step, axis=axis, extent=extent, points=points, step=grading.step)
        line = graded_line(start, end, size, grading.share)
        if axis == UP or _near_side(axis, 1.0, extent, points):
            line = _with_layer(line, grading.layer)
        if start < 0.0 and _near_side(axis, -1.0, extent, points):
            line = -_with_layer(-line[::-1], grading.layer)[::-1]
        lines.append(line)
    return lines[0], lines[1], lines[2]


def _near_side(axis: int, end: float, extent: tuple[float, float, float], points: Floats) -> bool:
    """Tell whether a side face is so near that its edges see the loads: a low layer screens what is farther."""
    gap = float(np.min(0.5 * extent[axis] - end * points[:, axis]))
    return gap <= SCREENED * extent[UP]


def _step(s: Floats, *, axis: int, extent: tuple[float, float, float], points: Floats, step: float) -> Floats:
    """Return the step [mm] at coordinates s of one axis: the part `step` of the distance to the nearest image."""
    height = extent[UP]
    along = s[:, None] - (points[:, axis] if axis != UP else 0.0)
    if axis == UP:
        # a slender column is clamped at its foot over its width, however high it is
        distance = np.minimum(DEPTH * (2.0 * height - s), SLENDER * min(extent[:UP]) + height - s)
    else:
        distance = np.hypot(along, height).min(axis=1)
    for across, end in itertools.product(range(UP), (-1.0, 1.0)):
        gap = 0.5 * extent[across] - end * points[:, across]
        reach = np.abs(2.0 * gap - end * along) if axis == across else np.hypot(along, gap)
        distance = np.minimum(distance, reach.min(axis=1))
    return step * distance


def _with_layer(line: Floats, layer: tuple[float, ...]) -> Floats:
    """Cut the last step into the parts of the layer."""
    cut = line[-2] + (line[-1] - line[-2]) * np.cumsum(layer)[:-1]
    return np.concatenate([line[:-1], cut, line[-1:]])
