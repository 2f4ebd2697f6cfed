"""A box of hexahedra between graded grid lines, with named faces.

A tensor-product box needs no mesh generator. Its grid lines are dense near the loads of the scene, preserve mirror
symmetry to rounding, and take milliseconds to compute. The mesh of a fruit for display is made in `mesh`.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from skfem import MeshHex

from sensor.arrays import Floats
from sensor.design.fruit import Fruit

Lines = tuple[Floats, Floats, Floats]  # increasing coordinates of grid lines along x, y and z [mm]

SAMPLES = 2000  # number of intervals for integrating the step density
UP = 2  # index of the z axis
# The next three values were found by halving steps, and are checked in tests/reference/fits/test_fruit.py.
SLENDER = 0.4  # distance over which the clamped base affects a slender column [widths]
SCREENED = 2.5  # distance over which a load affects a low block [heights]
DEPTH = 0.6  # limit of a step along z, as a fraction of the distance to the image load below the base
COARSER = 0.75  # number of steps in the coarser mesh of the error estimate, as a fraction of the finer mesh


def graded_line(start: float, end: float, step_size: Callable[[Floats], Floats], fraction: float = 1.0) -> Floats:
    """Return increasing coordinates from `start` to `end` [mm], with steps of at most about step_size(coordinate).

    The number of steps is the integral of 1 / step_size, rounded up. A `fraction` below 1 yields a coarser version of
    the same line: the number is multiplied by it and rounded down.
    """
    samples = np.linspace(start, end, SAMPLES + 1)
    density = 1.0 / step_size(0.5 * (samples[1:] + samples[:-1]))
    # Number of steps from `start` to each sample.
    step_count = np.concatenate([[0.0], np.cumsum(density)]) * (end - start) / SAMPLES
    # The margin makes the number of elements independent of rounding, so that scaled and mirrored boxes agree.
    element_count = max(1, int(fraction * np.ceil(step_count[-1] - 1e-6)))
    line = np.interp(np.linspace(0.0, step_count[-1], element_count + 1), step_count, samples)
    line[0] = start  # the ends are exact, despite round-off
    line[-1] = end
    return line


def box_mesh(lines: Lines) -> MeshHex:
    """Return the mesh of the box over grid lines along x, y and z [mm], with z down.

    The named faces are x_low, x_high, y_low, y_high, top (smallest z) and base (largest z).
    """
    mesh = MeshHex.init_tensor(*lines)
    facet_centres = mesh.p[:, mesh.facets].mean(axis=1)
    faces = {}
    for axis, (low_name, high_name) in enumerate((("x_low", "x_high"), ("y_low", "y_high"), ("top", "base"))):
        start = lines[axis][0]
        end = lines[axis][-1]
        tolerance = 1e-9 * (end - start)  # for round-off in the centres of facets
        faces[low_name] = np.flatnonzero(np.abs(facet_centres[axis] - start) <= tolerance)
        faces[high_name] = np.flatnonzero(np.abs(facet_centres[axis] - end) <= tolerance)
    return mesh.with_boundaries(faces)


@dataclass(frozen=True)
class Grading:
    """The mesh density of a block.

    `step` [1] is the ratio of a step to its distance from the nearest image load. The last step before the base and
    before each free side is divided in the proportions of `layer`, whose sum is 1. `fraction` [1] reduces the number of
    steps.
    """

    step: float
    layer: tuple[float, ...]
    fraction: float = 1.0

    def coarser(self) -> "Grading":
        """Return the grading of a coarser mesh: fewer steps along each axis, and one cell fewer in the layer."""
        return Grading(self.step, (*self.layer[:-2], self.layer[-2] + self.layer[-1]), COARSER)


def block_lines(block: Fruit, points: Floats, mirrored: Sequence[bool], grading: Grading) -> Lines:
    """Return grid lines [mm] along x, y and z that resolve the remainder field of loads on the top of a block.

    The remainder is the smooth difference between the fields of the block and of a half-space under the same loads
    (`solve/fruit/remainder.py`). The remainder resembles the field of image loads behind the faces of the block. A step
    is therefore proportional to its distance from the nearest image, and the last step at a face is divided into a
    layer.
    `grading` holds the ratio of step to distance, and the proportions of this layer. The block lies at |x| <= length/2,
    |y| <= width/2, 0 <= z <= height. `points` (n, 2) [mm] are the positions of the loads. `mirrored` holds two flags,
    for x and y, which are true if the lines start at the mirror plane, at 0.
    """
    extent = (block.length_mm, block.width_mm, block.height_mm)

    def step_size(s: Floats, axis: int) -> Floats:
        """Return the step [mm] at each coordinate `s` [mm] on an axis."""
        return grading.step * _edge_distance(s, axis, extent, points)

    lines = []
    for axis in (0, 1):
        end = 0.5 * extent[axis]
        start = 0.0 if mirrored[axis] else -end
        line = graded_line(start, end, partial(step_size, axis=axis), grading.fraction)
        # In a low block, the base screens a side face from loads farther away than `reach`. A face whose nearest load
        # is farther away needs no layer.
        reach = SCREENED * block.height_mm
        if float(np.min(end - points[:, axis])) <= reach:
            line = _with_layer(line, grading.layer)
        if start < 0.0 and float(np.min(end + points[:, axis])) <= reach:
            line = -_with_layer(-line[::-1], grading.layer)[::-1]  # reversing the line adds the layer at its low end
        lines.append(line)
    z_line = graded_line(0.0, block.height_mm, partial(step_size, axis=UP), grading.fraction)
    return lines[0], lines[1], _with_layer(z_line, grading.layer)


def _edge_distance(s: Floats, axis: int, extent: Sequence[float], points: Floats) -> Floats:
    """Return the distance [mm] that scales the steps at coordinates `s` [mm] on one axis.

    The displacement varies over the distance to the nearest image load, which is the mirror image of a load in a face
    of the block. `extent` (3,) [mm] is the size of the block. `points` (n, 2) [mm] are the positions of the loads on
    its top, relative to the centre of the top.
    """
    return np.minimum(_distance_to_base(s, axis, extent, points), _distance_to_sides(s, axis, extent, points))


def _distance_along(s: Floats, axis: int, points: Floats) -> Floats:
    """Return the signed distance [mm] along one axis from each load to each coordinate, (samples, loads or 1)."""
    return s[:, None] if axis == UP else s[:, None] - points[:, axis]  # all loads lie at z = 0


def _distance_to_base(s: Floats, axis: int, extent: Sequence[float], points: Floats) -> Floats:
    """Return the distance [mm] over which the clamped base affects the displacement at coordinates `s` [mm].

    Along z it is a fraction of the distance to the images at z = 2 height. In a slender column it depends on the width
    instead. Along x or y it is the distance to the base itself, which is smaller than the distance to the images.
    """
    height = extent[UP]
    if axis == UP:
        return np.minimum(DEPTH * (2.0 * height - s), SLENDER * min(extent[:UP]) + height - s)
    return np.asarray(np.hypot(_distance_along(s, axis, points), height).min(axis=1))


def _distance_to_sides(s: Floats, axis: int, extent: Sequence[float], points: Floats) -> Floats:
    """Return the smallest distance [mm] from coordinates `s` [mm] on one axis to the images behind the side faces.

    For a face that is parallel to this axis, it is the distance to the face itself, as for the base.
    """
    along = _distance_along(s, axis, points)
    distances = []
    for face_axis in range(UP):
        for end in (-1.0, 1.0):  # the face at the negative or at the positive end of this axis
            to_face = 0.5 * extent[face_axis] - end * points[:, face_axis]  # from each load
            to_image = np.abs(2.0 * to_face - end * along) if face_axis == axis else np.hypot(along, to_face)
            distances.append(to_image.min(axis=1))
    return np.asarray(np.min(distances, axis=0))


def _with_layer(line: Floats, layer: tuple[float, ...]) -> Floats:
    """Return the line with its last step divided in the proportions of `layer`, whose sum is 1."""
    layer_coordinates = line[-2] + (line[-1] - line[-2]) * np.cumsum(layer)[:-1]
    return np.concatenate([line[:-1], layer_coordinates, line[-1:]])
