"""The grid lines of the mesh that is bent into a curved fruit: dense under the tips, with a bounded number of dofs."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from sensor.arrays import Floats
from solve.fruit.box import Lines, graded_line
from solve.fruit.curved_shape import CurvedShape
from solve.fruit.smooth_load import SmoothLoad

LEAST_STEP = 0.5  # smallest distance between required grid lines [smallest standard deviation of a load]
SMALLER = 0.95  # factor by which the number of steps is reduced while a mesh has too many dofs


@dataclass(frozen=True)
class BodySteps:
    """The mesh density, given by the steps between grid lines.

    `at_load` is the step at a load [smallest standard deviation of a load]. `growth` [mm per mm] is the increase of the
    step with the distance from the load. `largest` [1] is the largest step as a fraction of the extent of the block. A
    `fraction` below 1 reduces the number of steps by this factor. The number is reduced further until the mesh has at
    most `most_dofs` dofs.
    """

    at_load: float = 1.0
    growth: float = 0.6
    largest: float = 0.25
    fraction: float = 1.0
    most_dofs: int = 9000


def body_lines(shape: CurvedShape, loads: Sequence[SmoothLoad], mirrored: Sequence[bool], steps: BodySteps) -> Lines:
    """Return the coordinates of the grid lines [mm] along x, y and z of the block.

    `shape` maps the block to the fruit. The lines are dense at the `loads`, as `steps` prescribes. `mirrored` holds two
    flags, for x and y, which are true if the mesh covers only one side of a mirror plane. The number of steps is
    reduced until the mesh has at most `steps.most_dofs` dofs.
    """
    lines = _lines_for_steps(shape, loads, mirrored, steps)
    # Quadratic elements have 2 n - 1 nodes on n grid lines, and three dofs per node.
    while 3 * math.prod(2 * len(line) - 1 for line in lines) > steps.most_dofs:
        steps = replace(steps, fraction=SMALLER * steps.fraction)
        lines = _lines_for_steps(shape, loads, mirrored, steps)
    return lines


def _lines_for_steps(
    shape: CurvedShape, loads: Sequence[SmoothLoad], mirrored: Sequence[bool], steps: BodySteps
) -> Lines:
    """Return the coordinates of the grid lines [mm] along x, y and z for given steps, without a limit on the dofs.

    Lines along x and y pass through the loads. Along a direction that is `mirrored`, they start at the mirror plane, at
    0. For a skin, there is a line at its base.
    """
    fruit = shape.fruit
    smallest_deviation = min(load.deviation for load in loads)
    centres = np.array([(load.x, load.y) for load in loads])
    lines = []
    for axis, extent in enumerate((fruit.length_mm, fruit.width_mm)):
        required_marks = _required_marks(shape, centres[:, axis], axis, is_mirrored=mirrored[axis])
        marks = _drop_close_marks(required_marks, LEAST_STEP * smallest_deviation)
        step_size = _make_step_size(centres[:, axis], extent, smallest_deviation, steps)
        lines.append(_line_through(marks, step_size, steps.fraction))
    # The loads act at z = 0, the top of the block, and z points downwards.
    skin_thickness = fruit.skin_mm or 0.0
    step_size = _make_step_size(np.zeros(1), fruit.depth_mm, smallest_deviation, steps)
    z_line = graded_line(skin_thickness, fruit.depth_mm, step_size, steps.fraction)
    if skin_thickness:  # the skin is one layer of elements
        z_line = np.concatenate([[0.0], z_line])
    return lines[0], lines[1], z_line


def _line_through(marks: Sequence[float], step_size: Callable[[Floats], Floats], fraction: float) -> Floats:
    """Return increasing coordinates [mm] from the first to the last mark, which include all marks between them.

    Each segment between two `marks` [mm] is graded separately, with the steps `step_size` [mm]. A `fraction` below 1
    reduces the number of steps.
    """
    line = np.array(marks[:1])
    for start, stop in pairwise(marks):
        segment = graded_line(start, stop, step_size, fraction)
        line = np.concatenate([line, segment[1:]])  # the first point of a segment is the last point of the line
    return line


def _required_marks(shape: CurvedShape, loads: Floats, axis: int, *, is_mirrored: bool) -> list[float]:
    """Return the increasing coordinates [mm] along x or y, axis 0 or 1, at which a grid line is needed.

    A line is needed at the ends of the block and at the positions of the `loads` (n,) [mm]. For a whole fruit, lines
    are also needed at the edges of its core, where the map from block to fruit has a kink. A mirrored axis starts at 0.
    """
    fruit = shape.fruit
    end = 0.5 * (fruit.length_mm, fruit.width_mm)[axis]
    marks = [-end, *loads.tolist(), end]
    if fruit.is_whole:
        marks += [-shape.core[axis], shape.core[axis]]
    if is_mirrored:
        marks = [0.0, *(mark for mark in marks if mark > 0.0)]
    return sorted(marks)


def _drop_close_marks(marks: Sequence[float], distance: float) -> list[float]:
    """Return increasing marks [mm] without those closer than `distance` [mm] to the previous mark or to the last one.

    Marks are coordinates at which a grid line is needed. The first and the last mark are always kept.
    """
    distant_marks = [marks[0]]
    for mark in marks[1:-1]:
        if min(mark - distant_marks[-1], marks[-1] - mark) > distance:
            distant_marks.append(mark)
    return [*distant_marks, marks[-1]]


def _make_step_size(
    loads: Floats, extent: float, smallest_deviation: float, steps: BodySteps
) -> Callable[[Floats], Floats]:
    """Return the function that maps coordinates on one axis [mm] to the step size there [mm].

    The step increases with the distance from the nearest load, up to a fraction of `extent`. `loads` (n,) [mm] are the
    coordinates of the loads on the axis, and `extent` [mm] is the length of the block along it. `smallest_deviation`
    [mm] is the smallest standard deviation of a load.
    """

    def step_size(s: Floats) -> Floats:
        """Return the step size [mm] at each coordinate `s` [mm]."""
        distance = np.abs(s[:, None] - loads).min(axis=1)
        growing = steps.at_load * smallest_deviation + steps.growth * distance
        return np.asarray(np.minimum(growing, steps.largest * extent))

    return step_size
