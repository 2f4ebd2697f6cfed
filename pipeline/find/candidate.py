"""A candidate of a search, and the one measure of how far a design is from passing."""

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

from pipeline.study.variation import Setting, is_number
from sensor.verdict import Verdict

MARGIN = 0.01  # of a limit, kept from it: the plate of printed springs moves each number by less
_FAILS = 2.0  # above the costs of designs that pass, which lie from -1 to 1
REFUSED_COST = 4.0


def shortfall(verdict: Verdict) -> float:
    """Return how far a verdict is from passing [1]: 0 where it passes with its margin.

    Else it is the margin and how far the worse end of its error bar lies beyond the limit, over the limit. The fraction
    of the poses that have no reading is added, and 1 stands for a verdict without a number. Whether a process can make
    a spring is left to the run where the beam law cannot tell.
    """
    if verdict.passed is None and verdict.row.value_level is not None:
        return 0.0
    value, limit = verdict.value, verdict.limit
    if not is_number(value) or not is_number(limit):
        return 0.0 if verdict.passed else 1.0
    width = abs(verdict.tolerance) if is_number(verdict.tolerance) else 0.0
    scale = abs(limit) or width or 1.0  # a limit of 0 is no measure of a distance, and without a tolerance the unit is
    distance = abs(value - limit) / scale
    if verdict.passed:
        return 0.0 if width else max(0.0, MARGIN - distance)  # a target is met on either side
    bar = verdict.error / scale if is_number(verdict.error) else 0.0
    match verdict.sense:
        case "at most":
            distance = max(0.0, (value - limit) / scale + bar)
        case "at least":
            distance = max(0.0, (limit - value) / scale + bar)
    return MARGIN + distance + _unread(verdict)


def _unread(verdict: Verdict) -> float:
    """Return in which fraction of the poses [1] there is no reading, for which a verdict on readings fails."""
    poses = re.match(r"(\d+) of (\d+) poses", verdict.reference) if verdict.row.needs == "reading" else None
    return int(poses[1]) / int(poses[2]) if poses else 0.0


@dataclass(frozen=True, kw_only=True)
class Candidate:
    """A design of a search: what it changes by TABLE.KEY, and its verdicts, None where it is refused or not solved.

    `value` is the number to be made least, compared as a multiple of `unit`; `number` is that of its point in a study.
    """

    changes: Mapping[str, Setting | None]
    verdicts: tuple[Verdict, ...] | None
    value: float = 0.0
    unit: float = 1.0
    number: int = 0

    @property
    def number_found(self) -> float | None:
        """Return the number to be made least [its unit]; None where the search refuses or cannot solve the design."""
        return self.value if self.verdicts is not None and math.isfinite(self.value) else None

    @cached_property
    def shortfall(self) -> float:
        """Return by how much all verdicts together fall short [1], 0 where they pass; infinite where it is refused."""
        return math.inf if self.verdicts is None else math.fsum(map(shortfall, self.verdicts))

    @property
    def passes(self) -> bool:
        """Say whether no verdict falls short."""
        return self.shortfall == 0.0

    @property
    def failed(self) -> tuple[Verdict, ...]:
        """Return the verdicts that do not pass, or not by their margin."""
        return tuple(verdict for verdict in self.verdicts or () if not verdict.passed or shortfall(verdict) > 0.0)

    @property
    def rank(self) -> tuple[float, int]:
        """Return the shortfall [1] and how many verdicts do not pass, by which the nearest to passing is least."""
        return self.shortfall, len(self.failed)

    @property
    def cost(self) -> float:
        """Return a number [1] in the order of the designs: those that pass, that fail verdicts, that are refused.

        The number to be made least, and among designs that fail the shortfall, are mapped by v / (1 + |v|).
        """
        if not math.isfinite(self.value) or not math.isfinite(self.shortfall):
            return REFUSED_COST
        if self.passes:
            objective = self.value / self.unit
            return objective / (1.0 + abs(objective))
        return _FAILS + self.shortfall / (1.0 + self.shortfall)
