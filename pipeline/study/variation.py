"""The variation of one key of a design over the points of a study: a range, a list, or a distribution."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TypeGuard

import cattrs
from scipy.special import ndtri

from pipeline.study.toml_records import MisfitError
from sensor.design.design_file import parsed_setting
from sensor.quantity import Bounds, as_float, check_fields, choice, quantity, text_field, validation_error

Setting = float | int | str | bool | tuple[float, ...]

_TAIL = 1e-9  # probability beyond which no point lies, at 6 standard deviations of a normal distribution
_BOTH = "give from and to, or mean and sd"
_SOURCE = "state the source of its numbers"


@dataclass(frozen=True, kw_only=True)
class Range:
    """Numbers between two ends, both included, in equal steps or equal ratios [unit of the key].

    `steps` is the number of values in a grid. A `distribution` is uniform over the range, and `source` states the
    origin of its ends.
    """

    low: float = quantity("", Bounds(), hint=_BOTH, key="from")
    high: float = quantity("", Bounds(), hint=_BOTH, key="to")
    steps: int | None = quantity(
        "", Bounds(at_least=2, at_most=10_000), default=None, hint="count both ends of the range"
    )
    log: bool = False
    distribution: str | None = choice(("uniform",), default=None, hint="give a normal distribution by mean and sd")
    source: str | None = text_field(default=None, hint=_SOURCE)

    def __post_init__(self) -> None:
        """Refuse an empty range, invalid steps, and a distribution without its source."""
        check_fields(self, "")
        if not self.low < self.high:
            bound = f"greater than from = {self.low:g}"
            raise validation_error("to", self.high, "", bound, "give a range of some width")
        if self.log and self.low <= 0.0:
            raise validation_error("from", self.low, "", "greater than 0 with log = true", "leave log out")
        if self.distribution is not None and self.source is None:
            raise validation_error("source", None, "", "given with a distribution", _SOURCE)

    def at(self, fraction: float) -> float:
        """Return the number at a fraction [1] of the range or of the distribution [unit of the key]."""
        if self.log:
            return self.low * math.pow(self.high / self.low, fraction)
        return self.low + (self.high - self.low) * fraction

    def fraction_of(self, value: object) -> float | None:
        """Return the fraction [1] of the range below a number [unit of the key]; None for any other value."""
        if not is_number(value) or not self.low <= value <= self.high:
            return None
        if self.log:
            return math.log(value / self.low) / math.log(self.high / self.low)
        return (value - self.low) / (self.high - self.low)

    def grid(self) -> tuple[Setting, ...]:
        """Return the numbers of a grid [unit of the key]; raises InputError without `steps`."""
        if self.steps is None:
            hint = "give the number of values, with both ends"
            raise validation_error("steps", None, "", "given with how = 'grid'", hint)
        return tuple(self.at(i / (self.steps - 1)) for i in range(self.steps))


@dataclass(frozen=True, kw_only=True)
class Choices:
    """The values of a list, numbers or words; each represents an equal share of Sobol points."""

    values: tuple[Setting, ...]

    def __post_init__(self) -> None:
        """Refuse an empty list."""
        if not self.values:
            raise validation_error("values", "[]", "", "a list of at least one value", "write at least one value")

    def at(self, fraction: float) -> Setting:
        """Return the value at a fraction [1] from 0 to 1 [unit of the key]."""
        return self.values[min(int(fraction * len(self.values)), len(self.values) - 1)]

    def fraction_of(self, value: object) -> float | None:
        """Return the middle of the fractions [1] of a value; None for one that is not in the list."""
        if value not in self.values:
            return None
        return (self.values.index(value) + 0.5) / len(self.values)

    def grid(self) -> tuple[Setting, ...]:
        """Return all values."""
        return self.values


@dataclass(frozen=True, kw_only=True)
class Normal:
    """A normal distribution with a mean and a standard deviation [unit of the key], and the source of both."""

    mean: float = quantity("", Bounds(), hint=_BOTH)
    sd: float = quantity("", Bounds(above=0.0), hint="give one value where nothing scatters")
    source: str = text_field(hint=_SOURCE)

    def __post_init__(self) -> None:
        """Refuse an invalid deviation, and a distribution without its source."""
        check_fields(self, "")

    def at(self, fraction: float) -> float:
        """Return the quantile at a fraction [1] of the distribution [unit of the key]."""
        return self.mean + self.sd * float(ndtri(min(max(fraction, _TAIL), 1.0 - _TAIL)))

    def grid(self) -> tuple[Setting, ...]:
        """Raise InputError, because a distribution has no grid."""
        bound = "sobol where a key has a distribution"
        raise validation_error("how", "grid", "", bound, "set how = 'sobol' and samples")


Variation = Range | Choices | Normal


def setting_of(value: object) -> Setting:
    """Return a TOML value as a value of a design key; raises MisfitError for dates, tables and nan."""
    numbers = value if isinstance(value, list) and value else [value]
    if isinstance(value, bool | str) or all(
        is_number(number) and math.isfinite(as_float(number)) for number in numbers
    ):
        return tuple(value) if isinstance(value, list) else value  # type: ignore[return-value]
    bound = "a finite number, a list of such, a truth value or text"
    raise MisfitError(value, bound, "correct that value")


def is_number(value: object) -> TypeGuard[float]:
    """Return whether a value is a number; a truth value is not, although it is an int in Python."""
    return isinstance(value, int | float) and not isinstance(value, bool)


def setting_of_cell(key: str, cell: str) -> Setting:
    """Return the value of a cell in the column of a key: a number or truth value in TOML's notation, else text."""
    try:
        return setting_of(parsed_setting(cell))
    except MisfitError as error:
        name = f"points.{key}"
        raise error.named(name) from error


def variation(given: object, converter: cattrs.Converter) -> Variation:
    """Return the variation of a key in a study file; its tables are structured by a converter of `file_converter`.

    A list is taken as it is. A table has `from` and `to` with `steps` or `log`, or `mean` and `sd`.
    """
    if isinstance(given, list):
        return Choices(values=tuple(map(setting_of, given)))
    if not isinstance(given, Mapping):
        bound = "a list, or a table with from and to, or with mean and sd"
        raise MisfitError(given, bound, "see docs/studies.md")
    if given.keys() & {"mean", "sd"}:
        return converter.structure(given, Normal)
    return converter.structure(given, Range)
