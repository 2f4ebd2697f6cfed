"""A box of hexahedra with graded lines and named faces.

A tensor-product box needs no mesher. Its lines follow the loads of the scene, keep mirror symmetry to rounding and cost
milliseconds. The fields of a fruit of any shape stay with the meshes of `mesh`.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from skfem import MeshHex

from sensor.arrays import Floats
from sensor.design.fruit import Fruit

Lines = tuple[Floats, Floats, Floats]  # rising coordinates along x, y and z [mm]

SAMPLES = 2000  # points at which the density of a line is summed
UP = 2  # the axis z
# Found by halving steps, watched by tests/reference/fits/test_fruit.py.
SLENDER = 0.4  # reach of the clamp of a slender column [widths]
SCREENED = 2.5  # reach of a low block's loads [heights]
DEPTH = 0.6  # fraction of the distance to the image below the base that a step along z may take account of
COARSER = 0.75  # fraction of the steps of the mesh that gives the error


def graded_line(start: float, end: float, size: Callable[[Floats], Floats], fraction: float = 1.0) -> Floats:
    """Return the fewest coordinates from start to end [mm] whose steps stay near size(coordinate) [mm].

    The number of steps is the integral of 1 / size. `fraction` < 1 takes that fraction of them, rounded down, as the
    coarser partner of the same line.
    """
    fine = np.linspace(start, end, SAMPLES + 1)
    density = 1.0 / size(0.5 * (fine[1:] + fine[:-1]))
    count = np.concatenate([[0.0], np.cumsum(density)]) * (end - start) / SAMPLES
    # the margin keeps the count the same for a scaled or mirrored box, whose sums differ by rounding
    elements = max(1, int(fraction * np.ceil(count[-1] - 1e-6)))
    line = np.interp(np.linspace(0.0, count[-1], elements + 1), count, fine)
    line[0] = start
    line[-1] = end
    return line


def box_mesh(lines: Lines) -> MeshHex:
    """Return the box over three rising lines [mm], z down: faces x_low, x_high, y_low, y_high, top (low z) and base."""
    mesh = MeshHex.init_tensor(*lines)
    middles = mesh.p[:, mesh.facets].mean(axis=1)
    faces = {}
    for axis, (low, high) in enumerate((("x_low", "x_high"), ("y_low", "y_high"), ("top", "base"))):
        start = lines[axis][0]
        end = lines[axis][-1]
        near = 1e-9 * (end - start)
        faces[low] = np.flatnonzero(np.abs(middles[axis] - start) <= near)
        faces[high] = np.flatnonzero(np.abs(middles[axis] - end) <= near)
    return mesh.with_boundaries(faces)


@dataclass(frozen=True)
class Grading:
    """How fine a block is divided: step over the distance to the nearest image load, and cells of the edge layer.

    `layer` are the parts, adding up to 1, into which the step next to the base and to each free side is cut.
    """

    step: float
    layer: tuple[float, ...]
    fraction: float = 1.0

    def coarser(self) -> "Grading":
        """Return the grading with fewer steps along every line and one cell less in the layer."""
        return Grading(self.step, (*self.layer[:-2], self.layer[-2] + self.layer[-1]), COARSER)


def block_lines(block: Fruit, points: Floats, mirrored: Sequence[bool], grading: Grading) -> Lines:
    """Return lines [mm] along x, y and z for the smooth remainder of loads on a block's top.

    The block lies at |x| <= length/2, |y| <= width/2, 0 <= z <= height. `points` (n, 2) are those of the loads. A
    mirrored axis, x or y, begins at 0. The remainder looks like the field of the loads' images behind the faces. So a
    step may be as large as its distance to the nearest image allows. The last step at a face is cut into a layer.
    """
    extent = (block.length_mm, block.width_mm, block.height_mm)

    def size(s: Floats, axis: int) -> Floats:
        return grading.step * _distance_to_image(s, axis, extent, points)

    lines = []
    for axis in (0, 1):
        end = 0.5 * extent[axis]
        start = 0.0 if mirrored[axis] else -end
        line = graded_line(start, end, partial(size, axis=axis), grading.fraction)
        # A low layer screens loads from a side face that is farther than its reach: no edge layer there.
        reach = SCREENED * block.height_mm
        if float(np.min(end - points[:, axis])) <= reach:
            line = _with_layer(line, grading.layer)
        if start < 0.0 and float(np.min(end + points[:, axis])) <= reach:
            line = -_with_layer(-line[::-1], grading.layer)[::-1]  # the same at the low end, turned round
        lines.append(line)
    down = graded_line(0.0, block.height_mm, partial(size, axis=UP), grading.fraction)
    return lines[0], lines[1], _with_layer(down, grading.layer)


def _distance_to_image(s: Floats, axis: int, extent: Sequence[float], points: Floats) -> Floats:
    """Return the distance [mm] from coordinates s of one axis to the nearest image of a load behind a face.

    An image lies behind a face as far as its load before it. `extent` (3,) [mm] is that of the block, `points` (n, 2)
    [mm] are those of the loads on its top.
    """
    height = extent[UP]
    # First the images behind the base; `along` is how far a coordinate lies from each load on its own axis.
    if axis == UP:
        along = s[:, None]  # the loads stand at 0
        # A slender column is clamped at its foot over its width, however high it is.
        distance = np.minimum(DEPTH * (2.0 * height - s), SLENDER * min(extent[:UP]) + height - s)
    else:
        along = s[:, None] - points[:, axis]
        distance = np.hypot(along, height).min(axis=1)
    # Then those behind the two side faces across x and the two across y.
    for across in range(UP):
        for end in (-1.0, 1.0):
            to_face = 0.5 * extent[across] - end * points[:, across]
            to_image = np.abs(2.0 * to_face - end * along)
            if across != axis:  # the face itself counts, which is nearer than the image behind it
                to_image = np.hypot(along, to_face)
            distance = np.minimum(distance, to_image.min(axis=1))
    return distance


def _with_layer(line: Floats, layer: tuple[float, ...]) -> Floats:
    """Return the line with its last step cut into the parts of the layer, fractions that add up to 1."""
    cut = line[-2] + (line[-1] - line[-2]) * np.cumsum(layer)[:-1]
    return np.concatenate([line[:-1], cut, line[-1:]])
