"""Ripeness classes: names with the modulus up to which each holds."""

import itertools
import math
from dataclasses import dataclass

from cad.quantity import validation_error

_EXAMPLE = "write for instance ripe:0.8,turning:1.6,unripe"


@dataclass(frozen=True)
class RipenessClasses:
    """Names of classes from the softest fruit on, and the largest modulus of each [MPa], infinite for the last."""

    names: tuple[str, ...]
    limits: tuple[float, ...]

    def of(self, E: float) -> str:
        """Return the class of a fruit of modulus E [MPa]."""
        return next(name for name, limit in zip(self.names, self.limits, strict=True) if limit >= E)


def ripeness_classes(text: str, flag: str = "--classes") -> RipenessClasses:
    """Return the classes of a text like `ripe:0.8,turning:1.6,unripe`, limits in MPa; raises InputError."""
    names, limits = [], []
    for part in text.split(","):
        name, colon, limit = part.strip().partition(":")
        if not name or not name.isprintable():
            raise validation_error(flag, text, "", "names, each but the last with a limit in MPa", _EXAMPLE)
        names.append(name)
        limits.append(_limit(flag, text, limit) if colon else math.inf)
    rising = all(one < other for one, other in itertools.pairwise(limits))
    if not rising or math.isfinite(limits[-1]):
        raise validation_error(flag, text, "", "classes with rising limits in MPa, the last without one", _EXAMPLE)
    return RipenessClasses(tuple(names), tuple(limits))


def _limit(flag: str, text: str, limit: str) -> float:
    try:
        value = float(limit)
    except ValueError:
        value = math.nan
    if not 0.0 < value < math.inf:
        raise validation_error(flag, text, "", f"limits in MPa above 0, not {limit!r}", _EXAMPLE)
    return value
