"""A candidate of a search, and its shortfall, which measures its distance from passing."""

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

from pipeline.study.variation import Setting, is_number
from sensor.verdict import Verdict

MARGIN = 0.01  # relative margin from a limit [1]; the compliance of printed plates changes every number by less
_FAIL_OFFSET = 2.0  # added to the costs of failing designs; it exceeds all costs of passing designs, from -1 to 1
REFUSED_COST = 4.0  # cost of a design that is invalid or cannot be solved; it exceeds all other costs


def shortfall(verdict: Verdict) -> float:
    """Return the relative distance of a verdict from passing [1]; 0 if it passes with the margin.

    If the verdict does not pass, the shortfall is the sum of three terms. These are the margin, the relative distance
    of the worse end of the error bar beyond the limit, and the fraction of unreadable poses. For a target, the distance
    of the value is used instead. If the verdict passes by less than the margin, the shortfall is the missing part of
    the margin. If it fails without a number, the shortfall is 1.
    """
    # A verdict with a `value_level` remains undecided with ideal springs. A run with fitted springs can decide it, so
    # it has no shortfall here.
    if verdict.passed is None and verdict.row.value_level is not None:
        return 0.0
    value, limit = verdict.value, verdict.limit
    if not is_number(value) or not is_number(limit):
        return 0.0 if verdict.passed else 1.0
    tolerance = abs(verdict.tolerance) if is_number(verdict.tolerance) else 0.0
    scale = abs(limit) or tolerance or 1.0  # if the limit is 0, the scale is the tolerance, or else one unit
    distance = abs(value - limit) / scale
    if verdict.passed:
        return 0.0 if tolerance else max(0.0, MARGIN - distance)  # a target with a tolerance does not need a margin
    error = verdict.error / scale if is_number(verdict.error) else 0.0
    # distance of the worse end of the error bar beyond a limit, or of the value from a target, which has no sense
    match verdict.sense:
        case "at most":
            excess = max(0.0, (value - limit) / scale + error)
        case "at least":
            excess = max(0.0, (limit - value) / scale + error)
        case _:
            excess = distance
    return MARGIN + excess + _unreadable_fraction(verdict)


def _unreadable_fraction(verdict: Verdict) -> float:
    """Return the fraction of the poses [1] without a reading; 0 for verdicts that do not depend on readings.

    The fraction is parsed from the reference of the verdict, a text such as "3 of 96 poses have no reading, ...".
    """
    poses = re.match(r"(\d+) of (\d+) poses", verdict.reference) if verdict.row.needs == "reading" else None
    return int(poses[1]) / int(poses[2]) if poses else 0.0


@dataclass(frozen=True, kw_only=True)
class Candidate:
    """A design in a search: its changes by TABLE.KEY, and its verdicts.

    `verdicts` is None if the design is invalid or cannot be solved. `value` is the value of the objective, nan if it is
    unknown. For comparisons it is divided by the scale `unit`. `number` is the number of the candidate's point in a
    study.
    """

    changes: Mapping[str, Setting | None]
    verdicts: tuple[Verdict, ...] | None
    value: float = 0.0
    unit: float = 1.0
    number: int = 0

    @property
    def number_found(self) -> float | None:
        """Return the objective [unit of the objective], or None if the design is invalid or cannot be solved."""
        return self.value if self.verdicts is not None and math.isfinite(self.value) else None

    @cached_property
    def shortfall(self) -> float:
        """Return the sum of the shortfalls of all verdicts [1]: 0 if all pass, infinite if there are no verdicts."""
        return math.inf if self.verdicts is None else math.fsum(map(shortfall, self.verdicts))

    @property
    def passes(self) -> bool:
        """Return whether all verdicts pass with the margin."""
        return self.shortfall == 0.0

    @property
    def failed(self) -> tuple[Verdict, ...]:
        """Return the verdicts that do not pass, or pass by less than the margin."""
        return tuple(verdict for verdict in self.verdicts or () if not verdict.passed or shortfall(verdict) > 0.0)

    @property
    def rank(self) -> tuple[float, int]:
        """Return the shortfall [1] and the number of failed verdicts; the nearest candidate has the lowest rank."""
        return self.shortfall, len(self.failed)

    @property
    def cost(self) -> float:
        """Return the cost [1] by which designs are ordered: passing ones first, then failing ones, then invalid ones.

        The cost of a passing design follows from its objective, and the cost of a failing design from its shortfall.
        Objective and shortfall are mapped by v / (1 + |v|), which preserves the order and lies between -1 and 1.
        Different offsets then keep the three groups apart.
        """
        if not math.isfinite(self.value) or not math.isfinite(self.shortfall):
            return REFUSED_COST
        if self.passes:
            objective = self.value / self.unit
            return objective / (1.0 + abs(objective))
        return _FAIL_OFFSET + self.shortfall / (1.0 + self.shortfall)
