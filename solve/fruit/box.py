"""A box of hexahedra with graded lines and named faces.

A tensor-product box needs no mesher. Its lines follow the loads of the scene, keep mirror symmetry up to rounding, and
take milliseconds. The mesh of a fruit for viewing is made in `mesh`.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from skfem import MeshHex

from sensor.arrays import Floats
from sensor.design.fruit import Fruit

Lines = tuple[Floats, Floats, Floats]  # rising coordinates along x, y and z [mm]

SAMPLES = 2000  # intervals for the integral of the density of a line
UP = 2  # the axis z
# Found by halving steps, checked by tests/reference/fits/test_fruit.py.
SLENDER = 0.4  # reach of the clamp of a slender column [widths]
SCREENED = 2.5  # reach of a low block's loads [heights]
DEPTH = 0.6  # fraction of the distance to the image below the base that limits a step along z
COARSER = 0.75  # fraction of the steps, for the mesh that gives the error


def graded_line(start: float, end: float, size: Callable[[Floats], Floats], fraction: float = 1.0) -> Floats:
    """Return the fewest coordinates from start to end [mm] whose steps are about size(coordinate) [mm].

    The number of steps is the integral of 1 / size. A `fraction` < 1 takes this fraction of them, rounded down, for the
    coarser version of the same line.
    """
    fine = np.linspace(start, end, SAMPLES + 1)
    density = 1.0 / size(0.5 * (fine[1:] + fine[:-1]))
    count = np.concatenate([[0.0], np.cumsum(density)]) * (end - start) / SAMPLES
    # the margin makes the count independent of rounding, for scaled and mirrored boxes
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
    """The fineness of a block: steps over the distance to the nearest image load, and cells of the edge layer.

    `layer` holds the parts, with sum 1, into which the step next to the base and to each free side is divided.
    """

    step: float
    layer: tuple[float, ...]
    fraction: float = 1.0

    def coarser(self) -> "Grading":
        """Return the grading with fewer steps along every line and one cell less in the layer."""
        return Grading(self.step, (*self.layer[:-2], self.layer[-2] + self.layer[-1]), COARSER)


def block_lines(block: Fruit, points: Floats, mirrored: Sequence[bool], grading: Grading) -> Lines:
    """Return lines [mm] along x, y and z for the smooth remainder of loads on a block's top.

    The block lies at |x| <= length/2, |y| <= width/2, 0 <= z <= height. `points` (n, 2) are the places of the loads. A
    mirrored axis, x or y, starts at 0. The remainder resembles the field of image loads behind the faces. So the size
    of a step is proportional to its distance from the nearest image. The last step at a face is divided into a layer.
    """
    extent = (block.length_mm, block.width_mm, block.height_mm)

    def size(s: Floats, axis: int) -> Floats:
        return grading.step * _distance_to_image(s, axis, extent, points)

    lines = []
    for axis in (0, 1):
        end = 0.5 * extent[axis]
        start = 0.0 if mirrored[axis] else -end
        line = graded_line(start, end, partial(size, axis=axis), grading.fraction)
        # In a low block, the base screens a load from a side face that is farther than `reach`, which needs no layer.
        reach = SCREENED * block.height_mm
        if float(np.min(end - points[:, axis])) <= reach:
            line = _with_layer(line, grading.layer)
        if start < 0.0 and float(np.min(end + points[:, axis])) <= reach:
            line = -_with_layer(-line[::-1], grading.layer)[::-1]  # the same at the low end, on the reversed line
        lines.append(line)
    down = graded_line(0.0, block.height_mm, partial(size, axis=UP), grading.fraction)
    return lines[0], lines[1], _with_layer(down, grading.layer)


def _distance_to_image(s: Floats, axis: int, extent: Sequence[float], points: Floats) -> Floats:
    """Return the distance [mm] from coordinates s on one axis to the nearest image of a load behind a face.

    An image lies as far behind a face as its load lies before it. `extent` (3,) [mm] is the size of the block, `points`
    (n, 2) [mm] are the places of the loads on its top.
    """
    height = extent[UP]
    # First the images behind the base; `along` is the distance of a coordinate from each load on its own axis.
    if axis == UP:
        along = s[:, None]  # the loads lie at 0
        # The clamp of a slender column has the reach of its width, for any height.
        distance = np.minimum(DEPTH * (2.0 * height - s), SLENDER * min(extent[:UP]) + height - s)
    else:
        along = s[:, None] - points[:, axis]
        distance = np.hypot(along, height).min(axis=1)
    # Then the images behind the side faces, two across x and two across y.
    for across in range(UP):
        for end in (-1.0, 1.0):
            to_face = 0.5 * extent[across] - end * points[:, across]
            to_image = np.abs(2.0 * to_face - end * along)
            if across != axis:  # the distance to the face is used, which is less than to the image
                to_image = np.hypot(along, to_face)
            distance = np.minimum(distance, to_image.min(axis=1))
    return distance


def _with_layer(line: Floats, layer: tuple[float, ...]) -> Floats:
    """Return the line with its last step divided into the parts of the layer, fractions with sum 1."""
    cut = line[-2] + (line[-1] - line[-2]) * np.cumsum(layer)[:-1]
    return np.concatenate([line[:-1], cut, line[-1:]])
