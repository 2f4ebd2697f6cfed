"""A candidate of a search, and its shortfall: the measure of its distance from passing."""

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

from pipeline.study.variation import Setting, is_number
from sensor.verdict import Verdict

MARGIN = 0.01  # relative margin from a limit [1]; the compliance of printed plates changes each number by less
_FAIL_OFFSET = 2.0  # offset of the costs of failing designs, above those of passing ones, which are from -1 to 1
REFUSED_COST = 4.0  # cost of an invalid or unsolvable design, above all others


def shortfall(verdict: Verdict) -> float:
    """Return the distance of a verdict from passing [1]; 0 if the verdict passes with a margin.

    A verdict that does not pass has the margin, plus the distance of the worse end of its error bar from the limit
    divided by the limit, plus the fraction of poses without a reading. A verdict that passes within the margin has the
    rest of the margin. A verdict that fails without a number has 1.
    """
    if verdict.passed is None and verdict.row.value_level is not None:  # beam theory cannot decide, but a run can
        return 0.0
    value, limit = verdict.value, verdict.limit
    if not is_number(value) or not is_number(limit):
        return 0.0 if verdict.passed else 1.0
    width = abs(verdict.tolerance) if is_number(verdict.tolerance) else 0.0
    scale = abs(limit) or width or 1.0  # a limit of 0 gives no scale; without a tolerance the unit is the scale
    distance = abs(value - limit) / scale
    if verdict.passed:
        return 0.0 if width else max(0.0, MARGIN - distance)  # a target with a tolerance needs no margin
    bar = verdict.error / scale if is_number(verdict.error) else 0.0
    match verdict.sense:
        case "at most":
            distance = max(0.0, (value - limit) / scale + bar)
        case "at least":
            distance = max(0.0, (limit - value) / scale + bar)
    return MARGIN + distance + _unreadable_fraction(verdict)


def _unreadable_fraction(verdict: Verdict) -> float:
    """Return the fraction of the poses [1] in which the sensor cannot be read; 0 for verdicts on other things."""
    poses = re.match(r"(\d+) of (\d+) poses", verdict.reference) if verdict.row.needs == "reading" else None
    return int(poses[1]) / int(poses[2]) if poses else 0.0


@dataclass(frozen=True, kw_only=True)
class Candidate:
    """A design of a search: its changes by TABLE.KEY, and its verdicts, or None if it is invalid or unsolvable.

    `value` is the value of the objective, which is divided by `unit` for a comparison. `number` is the number of the
    candidate's point in a study.
    """

    changes: Mapping[str, Setting | None]
    verdicts: tuple[Verdict, ...] | None
    value: float = 0.0
    unit: float = 1.0
    number: int = 0

    @property
    def number_found(self) -> float | None:
        """Return the value of the objective [its unit], or None if the design is invalid or unsolvable."""
        return self.value if self.verdicts is not None and math.isfinite(self.value) else None

    @cached_property
    def shortfall(self) -> float:
        """Return the sum of the shortfalls of all verdicts [1]: 0 if all pass, infinite if there are no verdicts."""
        return math.inf if self.verdicts is None else math.fsum(map(shortfall, self.verdicts))

    @property
    def passes(self) -> bool:
        """Return whether all verdicts pass with their margin."""
        return self.shortfall == 0.0

    @property
    def failed(self) -> tuple[Verdict, ...]:
        """Return the verdicts that do not pass with their margin."""
        return tuple(verdict for verdict in self.verdicts or () if not verdict.passed or shortfall(verdict) > 0.0)

    @property
    def rank(self) -> tuple[float, int]:
        """Return the shortfall [1] and the number of failed verdicts; the nearest candidate has the lowest rank."""
        return self.shortfall, len(self.failed)

    @property
    def cost(self) -> float:
        """Return the cost [1], by which designs are ordered: passing ones first, then failing ones, then invalid ones.

        For a passing design it follows from the objective v, and for a failing one from the shortfall v. Both are
        mapped by v / (1 + |v|), which keeps the order and lies between -1 and 1.
        """
        if not math.isfinite(self.value) or not math.isfinite(self.shortfall):
            return REFUSED_COST
        if self.passes:
            objective = self.value / self.unit
            return objective / (1.0 + abs(objective))
        return _FAIL_OFFSET + self.shortfall / (1.0 + self.shortfall)
