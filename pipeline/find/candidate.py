"""A candidate of a search, and the measure of its distance from passing."""

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

from pipeline.study.variation import Setting, is_number
from sensor.verdict import Verdict

MARGIN = 0.01  # margin kept from a limit [1]; the plate of printed springs changes each number by less
_FAILS = 2.0  # offset of failing designs, above the costs of passing ones from -1 to 1
REFUSED_COST = 4.0


def shortfall(verdict: Verdict) -> float:
    """Return the distance of a verdict from passing [1], 0 if it passes with its margin.

    Otherwise it is the margin plus the distance of the worse end of the error bar from the limit, relative to the
    limit. The fraction of poses without a reading is added. A failed verdict without a number counts 1. If the beam law
    cannot decide whether a spring can be printed, the run decides.
    """
    if verdict.passed is None and verdict.row.value_level is not None:
        return 0.0
    value, limit = verdict.value, verdict.limit
    if not is_number(value) or not is_number(limit):
        return 0.0 if verdict.passed else 1.0
    width = abs(verdict.tolerance) if is_number(verdict.tolerance) else 0.0
    scale = abs(limit) or width or 1.0  # a limit of 0 gives no scale; without a tolerance the unit is the scale
    distance = abs(value - limit) / scale
    if verdict.passed:
        return 0.0 if width else max(0.0, MARGIN - distance)  # a target may be missed to either side
    bar = verdict.error / scale if is_number(verdict.error) else 0.0
    match verdict.sense:
        case "at most":
            distance = max(0.0, (value - limit) / scale + bar)
        case "at least":
            distance = max(0.0, (limit - value) / scale + bar)
    return MARGIN + distance + _unread(verdict)


def _unread(verdict: Verdict) -> float:
    """Return the fraction of the poses [1] without a reading, for which a verdict on readings fails."""
    poses = re.match(r"(\d+) of (\d+) poses", verdict.reference) if verdict.row.needs == "reading" else None
    return int(poses[1]) / int(poses[2]) if poses else 0.0


@dataclass(frozen=True, kw_only=True)
class Candidate:
    """A design of a search: its changes by TABLE.KEY and its verdicts, None if it is refused or not solved.

    `value` is the number to minimise, compared as a multiple of `unit`. `number` is the number of its point in a study.
    """

    changes: Mapping[str, Setting | None]
    verdicts: tuple[Verdict, ...] | None
    value: float = 0.0
    unit: float = 1.0
    number: int = 0

    @property
    def number_found(self) -> float | None:
        """Return the number to minimise [its unit]; None if the search refuses or cannot solve the design."""
        return self.value if self.verdicts is not None and math.isfinite(self.value) else None

    @cached_property
    def shortfall(self) -> float:
        """Return the sum of the shortfalls of all verdicts [1], 0 if all pass, infinite without verdicts."""
        return math.inf if self.verdicts is None else math.fsum(map(shortfall, self.verdicts))

    @property
    def passes(self) -> bool:
        """Return whether no verdict falls short."""
        return self.shortfall == 0.0

    @property
    def failed(self) -> tuple[Verdict, ...]:
        """Return the verdicts that do not pass with their margin."""
        return tuple(verdict for verdict in self.verdicts or () if not verdict.passed or shortfall(verdict) > 0.0)

    @property
    def rank(self) -> tuple[float, int]:
        """Return the shortfall [1] and the number of failing verdicts; the nearest candidate has the least rank."""
        return self.shortfall, len(self.failed)

    @property
    def cost(self) -> float:
        """Return the cost [1], which orders designs: passing ones first, then failing ones, then refused ones.

        The number to minimise, or the shortfall of a failing design, is mapped by v / (1 + |v|).
        """
        if not math.isfinite(self.value) or not math.isfinite(self.shortfall):
            return REFUSED_COST
        if self.passes:
            objective = self.value / self.unit
            return objective / (1.0 + abs(objective))
        return _FAILS + self.shortfall / (1.0 + self.shortfall)
