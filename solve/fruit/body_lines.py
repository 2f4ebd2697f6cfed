"""Lines of the mesh that is bent into a curved fruit: fine under the tips, with a number of dofs that is bounded."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise

import numpy as np

from solve.arrays import Floats
from solve.fruit.box import Lines, graded_line
from solve.fruit.curved_shape import CurvedShape
from solve.fruit.smooth_load import SmoothLoad

LEAST_STEP = 0.5  # deviations of a load: lines closer than this become one
SMALLER = 0.95


@dataclass(frozen=True)
class BodySteps:
    """Steps at a load [deviations], their growth with the distance from it [1], the largest over the extent [1].

    `share` < 1 takes that share of the steps; `most_dofs` makes it smaller where there would be more dofs.
    """

    at_load: float = 1.0
    growth: float = 0.6
    largest: float = 0.25
    share: float = 1.0
    most_dofs: int = 9000


def body_lines(shape: CurvedShape, loads: Sequence[SmoothLoad], mirrored: tuple[bool, bool], steps: BodySteps) -> Lines:
    """Return lines [mm] along x, y and z of the block, from mirror planes where it has them; see `BodySteps`.

    Lines run through the loads, and on a whole fruit through the edges of the part that keeps its plan.
    """
    lines = _lines(shape, loads, mirrored, steps)
    while 3 * math.prod(2 * len(line) - 1 for line in lines) > steps.most_dofs:
        steps = replace(steps, share=SMALLER * steps.share)
        lines = _lines(shape, loads, mirrored, steps)
    return lines


def _lines(shape: CurvedShape, loads: Sequence[SmoothLoad], mirrored: tuple[bool, bool], steps: BodySteps) -> Lines:
    least = min(load.deviation for load in loads)
    extents = shape.fruit.length_mm, shape.fruit.width_mm, shape.fruit.depth_mm
    size = partial(_step, least=least, steps=steps)
    lines = []
    for axis, half in enumerate(mirrored):
        places = np.array([(load.x, load.y)[axis] for load in loads])
        through = _apart(_marks(shape, axis, places, half), LEAST_STEP * least)
        lines.append(_line(through, partial(size, places=places, extent=extents[axis]), steps.share))
    down = partial(size, places=np.zeros(1), extent=extents[2])
    return lines[0], lines[1], graded_line(0.0, extents[2], down, steps.share)


def _marks(shape: CurvedShape, axis: int, places: Floats, half: bool) -> list[float]:
    """Return the rising coordinates [mm] of one axis that lines should run through; from 0 on if `half`."""
    end = 0.5 * (shape.fruit.length_mm, shape.fruit.width_mm)[axis]
    marks = [-end, *places.tolist(), end]
    if shape.fruit.whole:
        marks += [-shape.core[axis], shape.core[axis]]
    return sorted([0.0, *(mark for mark in marks if mark > 0.0)] if half else marks)


def _apart(places: Sequence[float], least: float) -> list[float]:
    """Return the first and the last of rising places [mm], and of the others those that are this far apart."""
    kept = [places[0]]
    for place in places[1:-1]:
        if min(place - kept[-1], places[-1] - place) > least:
            kept.append(place)
    return [*kept, places[-1]]


def _line(places: Sequence[float], size: Callable[[Floats], Floats], share: float) -> Floats:
    parts = [graded_line(start, end, size, share) for start, end in pairwise(places)]
    return np.concatenate([parts[0], *(part[1:] for part in parts[1:])])


def _step(s: Floats, *, places: Floats, extent: float, least: float, steps: BodySteps) -> Floats:
    """Return the step [mm] at coordinates s of one axis."""
    distance = np.abs(s[:, None] - places).min(axis=1)
    step: Floats = np.minimum(steps.at_load * least + steps.growth * distance, steps.largest * extent)
    return step
