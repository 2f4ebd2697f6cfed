"""The numbers of a solved study by their keys: eight bytes each, so that a million points fit into memory."""

import math
from array import array
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.study.store import StudyStore
from sensor.arrays import Floats

_ROUND_OFF = 1e-12  # of a number


@dataclass(frozen=True, kw_only=True, eq=False)
class PointColumns:
    """The numbers of the points that are done (points,), and the values of each key whose values are numbers.

    `values` holds arrays of shape (points,) [unit of the key], nan where a report has null. Keys of texts and of truth
    values have none: `counts` says how many points have each of theirs.
    """

    points: NDArray[np.int64]
    values: Mapping[str, Floats]
    counts: Mapping[str, Mapping[str | bool, int]]

    def differs(self, key: str) -> bool:
        """Say whether the values of a key are numbers that differ by more than round-off."""
        if key not in self.values:
            return False
        low, high = self.span(key)
        return high - low > _ROUND_OFF * max(abs(low), abs(high))

    def span(self, key: str) -> tuple[float, float]:
        """Return the least and the largest value of a key [its unit]."""
        return float(np.nanmin(self.values[key])), float(np.nanmax(self.values[key]))

    def best(self, key: str, count: int) -> list[int]:
        """Return the numbers of the points with the least values of a key, the least first, those without one last."""
        order = np.arange(len(self.points))
        if key in self.values:
            order = np.argsort(self.values[key], kind="stable")  # nan sorts last
        return list(map(int, self.points[order[:count]]))


def point_columns(store: StudyStore, keys: Sequence[str]) -> PointColumns:
    """Return the numbers that the points of a store that are done have for some keys.

    Only one point is in memory at a time, beside eight bytes for each of its numbers.
    """
    points = array("q")
    columns = {key: array("d") for key in keys}
    counts: dict[str, Counter[str | bool]] = {key: Counter() for key in keys}
    for point in store.rows():
        if point.status != "done":
            continue
        points.append(point.number)
        point_values = {**point.settings, **point.values}
        for key, column in columns.items():
            value = point_values.get(key)
            if isinstance(value, str | bool):
                counts[key][value] += 1
            column.append(value if isinstance(value, int | float) and not isinstance(value, bool) else math.nan)
    values = {}
    for key, column in columns.items():
        numbers = np.array(column)
        if not np.isnan(numbers).all():
            values[key] = numbers
    return PointColumns(points=np.array(points, dtype=np.int64), values=values, counts=counts)
