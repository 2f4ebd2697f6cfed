"""Lines of the mesh that is bent into a curved fruit: fine under the tips, with a bounded number of dofs."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from sensor.arrays import Floats
from solve.fruit.box import Lines, graded_line
from solve.fruit.curved_shape import CurvedShape
from solve.fruit.smooth_load import SmoothLoad

LEAST_STEP = 0.5  # least distance of two lines [deviations of a load]; closer lines are merged
SMALLER = 0.95  # factor of the number of steps if a mesh has too many dofs


@dataclass(frozen=True)
class BodySteps:
    """Steps at a load [deviations], their growth with the distance from it [1], the largest step over the extent [1].

    A `fraction` < 1 takes this fraction of the steps; it is reduced further if there would be more than `most_dofs`.
    """

    at_load: float = 1.0
    growth: float = 0.6
    largest: float = 0.25
    fraction: float = 1.0
    most_dofs: int = 9000


def body_lines(shape: CurvedShape, loads: Sequence[SmoothLoad], mirrored: Sequence[bool], steps: BodySteps) -> Lines:
    """Return lines [mm] along x, y and z of the block, starting at its mirror planes x = 0 and y = 0, if any.

    Lines run through the loads. A whole fruit also has lines at the edges of its core, and a skin has a line at its
    base. The number of steps is reduced until the mesh has at most `steps.most_dofs`.
    """
    lines = _lines(shape, loads, mirrored, steps)
    while 3 * math.prod(2 * len(line) - 1 for line in lines) > steps.most_dofs:
        steps = replace(steps, fraction=SMALLER * steps.fraction)
        lines = _lines(shape, loads, mirrored, steps)
    return lines


def _lines(shape: CurvedShape, loads: Sequence[SmoothLoad], mirrored: Sequence[bool], steps: BodySteps) -> Lines:
    """Return the lines [mm] along x, y and down for given steps, dense near the loads.

    A mirrored axis starts at 0. A whole fruit has lines at the edges of its core, and a skin has a line at its base.
    """
    fruit = shape.fruit
    least = min(load.deviation for load in loads)
    centres = np.array([(load.x, load.y) for load in loads])
    along_axis = []
    for axis, extent in enumerate((fruit.length_mm, fruit.width_mm)):
        end = 0.5 * extent
        marks = [-end, *centres[:, axis].tolist(), end]
        if fruit.whole:
            marks += [-shape.core[axis], shape.core[axis]]
        if mirrored[axis]:
            marks = [0.0, *(mark for mark in marks if mark > 0.0)]
        marks = _apart(sorted(marks), LEAST_STEP * least)

        size = _step_size(centres[:, axis], extent, least, steps)
        line = np.array(marks[:1])
        for start, stop in pairwise(marks):
            part = graded_line(start, stop, size, steps.fraction)
            line = np.concatenate([line, part[1:]])
        along_axis.append(line)
    skin = fruit.skin_mm or 0.0
    size = _step_size(np.zeros(1), fruit.depth_mm, least, steps)
    down = graded_line(skin, fruit.depth_mm, size, steps.fraction)
    if skin:
        down = np.concatenate([[0.0], down])
    return along_axis[0], along_axis[1], down


def _apart(marks: Sequence[float], least: float) -> list[float]:
    """Return the first and the last of rising marks, and those between that lie more than `least` from others."""
    kept = [marks[0]]
    for mark in marks[1:-1]:
        if min(mark - kept[-1], marks[-1] - mark) > least:
            kept.append(mark)
    return [*kept, marks[-1]]


def _step_size(loads: Floats, extent: float, least: float, steps: BodySteps) -> Callable[[Floats], Floats]:
    """Return the step [mm] at coordinates of one axis [mm], which grows with the distance from loads (n,) on it.

    `extent` [mm] is the length of the block along the axis. `least` [mm] is the smallest standard deviation of a load.
    """

    def size(s: Floats) -> Floats:
        distance = np.abs(s[:, None] - loads).min(axis=1)
        return np.asarray(np.minimum(steps.at_load * least + steps.growth * distance, steps.largest * extent))

    return size
