"""The points of a study in order: a grid, a Sobol sequence, or the rows of a file."""

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

_SOBOL_BITS = 30


@dataclass(frozen=True, kw_only=True)
class Point:
    """One point of a study: its number, from 0, and the value of each varied key."""

    number: int
    settings: Mapping[str, Setting]


def point_count(study: Study) -> int:
    """Return the number of points of a study.

    Raises InputError for a search, whose number of points is unknown, and for a grid of more than MAX_POINTS points.
    """
    match study.how:
        case "points":
            return len(study.rows)
        case "sobol":
            return study.samples
        case "sensitivity":  # Saltelli's scheme
            return study.samples * (len(study.vary) + 2)
        case "search":
            bound = "sobol, grid or points for a study"
            raise validation_error("how", study.how, "", bound, "run it with: pipeline optimise")
    count = math.prod(len(varied.grid()) for varied in study.vary.values())
    if count > MAX_POINTS:
        raise validation_error("vary", count, "points", f"at most {MAX_POINTS}", "take fewer steps")
    return count


def points_of(study: Study) -> Iterator[Point]:
    """Yield every point of a study in order.

    Sobol points are nested: a study with more samples begins with the points of the same study with fewer.
    """
    for number, settings in enumerate(_settings(study)):
        yield Point(number=number, settings=settings)


def _settings(study: Study) -> Iterator[Mapping[str, Setting]]:
    """Yield the settings of each point of a study that is not a search."""
    if study.how in ("sobol", "sensitivity"):
        fractions = _saltelli_fractions(study) if study.how == "sensitivity" else _sobol_fractions(study)
        yield from map(study.settings_at, fractions)
        return
    rows: Iterable[Sequence[Setting]] = study.rows
    if study.how == "grid":
        rows = itertools.product(*(varied.grid() for varied in study.vary.values()))  # the last key varies fastest
    for row in rows:
        yield dict(zip(study.vary, row, strict=True))


def _sobol_fractions(study: Study) -> Iterator[list[float]]:
    """Yield the points of a scrambled Sobol sequence as fractions [1] of each key's range.

    They are drawn one by one, because SciPy expects a power of two when it draws several at once.
    """
    sequence = qmc.Sobol(len(study.vary), scramble=True, bits=_SOBOL_BITS, rng=study.seed)
    for _ in range(study.samples):
        yield sequence.random()[0].tolist()


def _saltelli_fractions(study: Study) -> Iterator[list[float]]:
    """Yield the points at which SciPy's sensitivity analysis needs values, in its order.

    A point is a list of fractions [1] of each key's range. SciPy does not return its points, so they are recorded in a
    trial analysis.
    """
    recorded: list[Floats] = []

    def record_fractions(fractions: Floats) -> Floats:
        recorded.append(fractions)
        return fractions.copy()  # any varying numbers will do, because the indices are not used

    saltelli_indices(study, record_fractions)
    for fractions in recorded:
        yield from fractions.T.tolist()


def saltelli_indices(study: Study, numbers_at: Callable[[Floats], Floats]) -> Any:  # noqa: ANN401 - SciPy's record
    """Return SciPy's Sobol indices of a function of the varied keys.

    `numbers_at` takes fractions [1] of the keys' ranges (keys, points) and returns its values at these points. The seed
    of the study fixes the points, so they are the same on every call.
    """
    distributions: list[Any] = [uniform()] * len(study.vary)
    return sobol_indices(func=numbers_at, n=study.samples, dists=distributions, rng=study.seed)
