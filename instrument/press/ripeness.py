"""Ripeness classes: names, each with the largest modulus of its class."""

import math
from dataclasses import dataclass

from sensor.quantity import parse_number, validation_error

_HINT = "write for instance ripe:0.8,turning:1.6,unripe"


@dataclass(frozen=True)
class RipenessClasses:
    """Class names from the softest fruit to the firmest, with their largest moduli [MPa]; the last is infinite."""

    names: tuple[str, ...]
    limits: tuple[float, ...]

    def class_of(self, E: float) -> str:
        """Return the name of the class of a fruit with modulus E [MPa]: the first class whose limit is at least E."""
        return next(name for name, limit in zip(self.names, self.limits, strict=True) if limit >= E)


def ripeness_classes(text: str, flag: str = "--classes") -> RipenessClasses:
    """Parse classes such as `ripe:0.8,turning:1.6,unripe`, where the numbers are limits in MPa.

    `flag` is the name of the text in messages. Raises InputError if a class has no name, if the limits do not increase,
    or if the last class has a limit.
    """
    names = []
    limits = []
    previous_limit = 0.0  # the first limit must be positive
    for part in text.split(","):
        name, colon, limit_text = part.strip().partition(":")
        limit = parse_number(limit_text) if colon else math.inf  # None if the text is not a number
        if not name or not name.isprintable() or limit is None or limit <= previous_limit:
            bound = "a list of names, all but the last with a limit in MPa, in increasing order"
            raise validation_error(flag, text, "", bound, _HINT)
        names.append(name)
        limits.append(limit)
        previous_limit = limit
    if math.isfinite(previous_limit):
        raise validation_error(flag, text, "", "a list whose last class has no limit", _HINT)
    return RipenessClasses(tuple(names), tuple(limits))
