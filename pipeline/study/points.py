"""The points of a study in order: a grid, a Sobol sequence, or the rows of a file."""

import itertools
import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from scipy.stats import qmc, sobol_indices, uniform

from pipeline.study.study_file import MOST_POINTS, Study
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
    """Return the number of points of a study; raises InputError for a search and for a grid that is too fine."""
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


def points_of(study: Study) -> Iterator[Point]:
    """Yield every point of a study; a study with more samples begins with the points of one with fewer."""
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
    """Yield the points of a scrambled Sobol sequence [1], one by one, because larger calls require powers of two."""
    sequence = qmc.Sobol(len(study.vary), scramble=True, bits=_SOBOL_BITS, rng=study.seed)
    for _ in range(study.samples):
        yield sequence.random()[0].tolist()


def _saltelli_fractions(study: Study) -> Iterator[list[float]]:
    """Yield the points [1] at which SciPy's sensitivity analysis needs values, in its order."""
    drawn: list[Floats] = []

    def note(fractions: Floats) -> Floats:
        drawn.append(fractions)
        return fractions.copy()  # any varying numbers do, because SciPy subtracts their mean

    saltelli_indices(study, note)
    for fractions in drawn:
        yield from fractions.T.tolist()


def saltelli_indices(study: Study, numbers_at: Callable[[Floats], Floats]) -> Any:  # noqa: ANN401 - SciPy's record
    """Return SciPy's Sobol indices of values (numbers, points) at fractions [1] (keys, points).

    The function `numbers_at` is called with the same points on every call of this function.
    """
    spans: list[Any] = [uniform()] * len(study.vary)
    return sobol_indices(func=numbers_at, n=study.samples, dists=spans, rng=study.seed)
