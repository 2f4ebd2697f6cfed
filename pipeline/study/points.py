"""The points of a study in order: a grid, a Sobol sequence, Saltelli's scheme, or the rows of a file."""

import itertools
import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from scipy.stats import qmc, sobol_indices, uniform

from pipeline.study.study_file import MAX_POINTS, Study
from pipeline.study.variation import Setting
from sensor.arrays import Floats
from sensor.quantity import validation_error

_SOBOL_BITS = 30  # bits of the generator; it can draw up to 2^30 points


@dataclass(frozen=True, kw_only=True)
class Point:
    """One point of a study: its number, counted from 0, and the value of each varied key."""

    number: int
    settings: Mapping[str, Setting]


def point_count(study: Study) -> int:
    """Return the number of points of a study, which depends on its method of sampling.

    Raises InputError for a search, whose number of points is not known in advance, and for a grid with more than
    MAX_POINTS points.
    """
    match study.how:
        case "points":
            return len(study.rows)
        case "sobol":
            return study.samples
        case "sensitivity":
            # Saltelli's scheme has two sample matrices, and for each key a matrix that mixes both.
            return study.samples * (len(study.vary) + 2)
        case "search":
            bound = "sobol, grid, points or sensitivity for a study"
            raise validation_error("how", study.how, "", bound, "run a search with: pipeline optimise")
    # The only other method is a grid, which has a point for each combination of values.
    count = math.prod(len(varied.grid()) for varied in study.vary.values())
    if count > MAX_POINTS:
        raise validation_error("vary", count, "points", f"at most {MAX_POINTS}", "choose fewer steps")
    return count


def points_of(study: Study) -> Iterator[Point]:
    """Yield all points of a study in order.

    A Sobol study with more samples begins with the same points as a study with fewer samples.
    """
    for number, settings in enumerate(_settings(study)):
        yield Point(number=number, settings=settings)


def _settings(study: Study) -> Iterator[Mapping[str, Setting]]:
    """Yield the settings of each point of a study that is not a search."""
    if study.how == "sobol":
        yield from map(study.settings_at, _sobol_fractions(study))
    elif study.how == "sensitivity":
        yield from map(study.settings_at, _saltelli_fractions(study))
    else:
        rows: Iterable[Sequence[Setting]] = study.rows  # the values of a file of points
        if study.how == "grid":
            rows = itertools.product(*(varied.grid() for varied in study.vary.values()))  # the last key varies fastest
        for row in rows:
            yield dict(zip(study.vary, row, strict=True))


def _sobol_fractions(study: Study) -> Iterator[list[float]]:
    """Yield the points of a scrambled Sobol sequence, each as fractions [1] of the ranges of the keys.

    The points are drawn one by one, because SciPy warns if the number of points drawn at once is not a power of two.
    """
    sequence = qmc.Sobol(len(study.vary), scramble=True, bits=_SOBOL_BITS, rng=study.seed)
    for _ in range(study.samples):
        yield sequence.random()[0].tolist()


def _saltelli_fractions(study: Study) -> Iterator[list[float]]:
    """Yield the points at which SciPy's sensitivity analysis evaluates its function, in the same order.

    A point is a list of fractions [1] of the ranges of the keys. SciPy does not return its points, so they are recorded
    in a trial analysis, whose indices are not used.
    """
    recorded: list[Floats] = []  # an array (keys, points) for each call of the function

    def record_fractions(fractions: Floats) -> Floats:
        recorded.append(fractions)
        return fractions.copy()  # arbitrary values, but not constant, so that the variance is not 0

    saltelli_indices(study, record_fractions)
    for fractions in recorded:
        yield from fractions.T.tolist()


def saltelli_indices(study: Study, numbers_at: Callable[[Floats], Floats]) -> Any:  # noqa: ANN401 - SciPy's record
    """Compute the Sobol indices of a function of the varied keys with SciPy.

    `numbers_at` is this function: it takes fractions (keys, points) [1] of the ranges of the keys, and returns its
    values at these points. The seed of the study determines the points, so they are the same in every call.
    """
    distributions: list[Any] = [uniform()] * len(study.vary)
    return sobol_indices(func=numbers_at, n=study.samples, dists=distributions, rng=study.seed)
