"""The points of a study, by their numbers: those of a grid, of a Sobol sequence, or of the rows of a file."""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import qmc

from pipeline.study.study_file import MOST_POINTS, Study
from pipeline.study.variation import Setting
from sensor.design.parameters import Design
from sensor.quantity import validation_error

SOBOL_BITS = 30


@dataclass(frozen=True, kw_only=True)
class Point:
    """One point of a study: its number from 0, and the value of each key that varies."""

    number: int
    settings: Mapping[str, Setting]


def point_count(study: Study) -> int:
    """Return the number of points of a study."""
    match study.how:
        case "points":
            return len(study.rows)
        case "sobol":
            return study.samples
        case "sensitivity":
            return study.samples * (len(study.vary) + 2)
        case "search":
            bound = "sobol, grid or points for a study"
            raise validation_error("how", study.how, "", bound, "run it with: pipeline optimise")
    count = math.prod(len(varied.grid()) for varied in study.vary.values())
    if count > MOST_POINTS:
        raise validation_error("vary", count, "points", f"at most {MOST_POINTS}", "take fewer steps")
    return count


def points_between(study: Study, start: int, stop: int) -> Iterator[Point]:
    """Yield the points from a number up to, not including, another one; the same ones whoever asks."""
    numbers = range(start, stop)
    if study.how == "points":
        for number in numbers:
            yield _point(study, number, study.rows[number])
    elif study.how == "grid":
        grids = [varied.grid() for varied in study.vary.values()]
        for number in numbers:
            indices = np.unravel_index(number, [len(grid) for grid in grids])  # the last key varies fastest
            yield _point(study, number, [grid[index] for grid, index in zip(grids, indices, strict=True)])
    else:
        fractions = _exchanged if study.how == "sensitivity" else _sobol
        for number, row in zip(numbers, fractions(study, start, stop), strict=True):
            yield point_at(study, number, row)


def _point(study: Study, number: int, values: Iterable[Setting]) -> Point:
    return Point(number=number, settings=dict(zip(study.vary, values, strict=True)))


def point_at(study: Study, number: int, fractions: Sequence[float]) -> Point:
    """Return the point at fractions [1] from 0 to 1 of what varies, in the order of the study file."""
    varied = zip(study.vary.values(), fractions, strict=True)
    return _point(study, number, [variation.at(fraction) for variation, fraction in varied])


def _sobol(study: Study, start: int, stop: int) -> list[list[float]]:
    return sobol_fractions(len(study.vary), study.seed, start, stop)


def sobol_fractions(keys: int, seed: int, start: int, stop: int) -> list[list[float]]:
    """Return points of a scrambled Sobol sequence [1], (points, keys): a longer one begins with those of a shorter."""
    sequence = qmc.Sobol(keys, scramble=True, bits=SOBOL_BITS, rng=seed)
    if start:
        sequence.fast_forward(start)
    # The first point by itself: a call for more would ask for a power of two.
    first = sequence.random(min(1, stop - start)).tolist()
    others = sequence.random(max(0, stop - start - 1)).tolist()
    return [*first, *others]


def _exchanged(study: Study, start: int, stop: int) -> Iterator[list[float]]:
    """Yield the fractions [1] of the points from a number up to another one for a study of sensitivities.

    Points come in blocks of `samples`. Block 0 is sample A, block 1 sample B, and each further one, for one key after
    the other, A with this key from B.
    """
    keys = len(study.vary)
    while start < stop:
        block, first_row = divmod(start, study.samples)
        end = min(stop, (block + 1) * study.samples)  # of the points asked for in this block
        for row in sobol_fractions(2 * keys, study.seed, first_row, first_row + end - start):
            sample_A = row[:keys]
            sample_B = row[keys:]
            if block > 1:
                exchanged = block - 2
                sample_A[exchanged] = sample_B[exchanged]
            yield sample_B if block == 1 else sample_A
        start = end


def design_of(study: Study, settings: Mapping[str, Setting | None]) -> Design:
    """Return the design of a point; raises InputError where it is outside the bounds of the design file."""
    return study.base.design(settings)
