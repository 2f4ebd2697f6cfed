"""The variation of one key of a design over the points of a study: a range, a list, or a distribution."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TypeGuard

import cattrs
from scipy.special import ndtri

from pipeline.study.toml_records import MisfitError
from sensor.design.design_file import parse_setting
from sensor.quantity import Bounds, as_float, check_fields, choice, quantity, text_field, validation_error

Setting = float | int | str | bool | tuple[float, ...]

_TAIL = 1e-9  # probability beyond which no point lies, at 6 standard deviations of a normal distribution
_BOTH = "give from and to, or mean and sd"
_SOURCE = "state the source of its numbers"


@dataclass(frozen=True, kw_only=True)
class Range:
    """A range of numbers from `low` to `high` [unit of the key], divided in equal steps, or with `log` in equal ratios.

    `steps` is the number of values in a grid, both ends included. With a `distribution` the key is a random variable,
    and `source` must then cite where the ends come from.
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
        """Raise InputError for an empty range, invalid steps, or a distribution without its source."""
        check_fields(self, "")
        if not self.low < self.high:
            bound = f"greater than from = {self.low:g}"
            raise validation_error("to", self.high, "", bound, "exchange the ends, or give a list with one value")
        if self.log and self.low <= 0.0:
            raise validation_error("from", self.low, "", "greater than 0 with log = true", "leave log out")
        if self.distribution is not None and self.source is None:
            raise validation_error("source", None, "", "given with a distribution", _SOURCE)

    def at(self, fraction: float) -> float:
        """Return the number [unit of the key] at a fraction [1] of the range, from 0 at `low` to 1 at `high`."""
        if self.log:
            return self.low * math.pow(self.high / self.low, fraction)
        return self.low + (self.high - self.low) * fraction

    def fraction_of(self, value: object) -> float | None:
        """Return the fraction [1] of the range at a number [unit of the key], the inverse of `at`.

        None for a number outside the range, and for a value that is not a number.
        """
        if not is_number(value) or not self.low <= value <= self.high:
            return None
        if self.log:
            return math.log(value / self.low) / math.log(self.high / self.low)
        return (value - self.low) / (self.high - self.low)

    def grid(self) -> tuple[Setting, ...]:
        """Return the numbers of a grid [unit of the key]; raises InputError if the range has no `steps`."""
        if self.steps is None:
            hint = "give the number of values, with both ends"
            raise validation_error("steps", None, "", "given with how = 'grid'", hint)
        return tuple(self.at(i / (self.steps - 1)) for i in range(self.steps))


@dataclass(frozen=True, kw_only=True)
class Choices:
    """A list of values, each a number or a text; each value gets an equal share of the Sobol points."""

    values: tuple[Setting, ...]

    def __post_init__(self) -> None:
        """Raise InputError for an empty list."""
        if not self.values:
            raise validation_error("values", "[]", "", "a list of at least one value", "write at least one value")

    def at(self, fraction: float) -> Setting:
        """Return the value [unit of the key] at a fraction [1] of the list, from 0 to 1."""
        return self.values[min(int(fraction * len(self.values)), len(self.values) - 1)]

    def fraction_of(self, value: object) -> float | None:
        """Return the middle of the interval of fractions [1] that belongs to a value; None if it is not in the list."""
        if value not in self.values:
            return None
        return (self.values.index(value) + 0.5) / len(self.values)

    def grid(self) -> tuple[Setting, ...]:
        """Return all values; a grid contains each of them."""
        return self.values


@dataclass(frozen=True, kw_only=True)
class Normal:
    """A normal distribution with a mean and a standard deviation [unit of the key], and the source of both."""

    mean: float = quantity("", Bounds(), hint=_BOTH)
    sd: float = quantity("", Bounds(above=0.0), hint="give a list with one value if the key is known exactly")
    source: str = text_field(hint=_SOURCE)

    def __post_init__(self) -> None:
        """Raise InputError for a standard deviation that is not positive, or an empty source."""
        check_fields(self, "")

    def at(self, fraction: float) -> float:
        """Return the quantile [unit of the key] at a fraction [1] of the distribution."""
        return self.mean + self.sd * float(ndtri(min(max(fraction, _TAIL), 1.0 - _TAIL)))

    def grid(self) -> tuple[Setting, ...]:
        """Raise InputError, because a distribution has no grid."""
        bound = "sobol where a key has a distribution"
        raise validation_error("how", "grid", "", bound, "set how = 'sobol' and samples")


Variation = Range | Choices | Normal


def setting_of(value: object) -> Setting:
    """Return a TOML value as a value of a design key, in which a list becomes a tuple.

    Raises MisfitError for a date, a table, an empty list, a list of other things than numbers, and nan.
    """
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
    """Return the value of a cell in the column of a key: a number or truth value in TOML's notation, else text.

    Raises InputError for any other TOML value, such as a date.
    """
    try:
        return setting_of(parse_setting(cell))
    except MisfitError as error:
        name = f"points.{key}"
        raise error.named(name) from error


def variation_of(data: object, converter: cattrs.Converter) -> Variation:
    """Return the variation of a key from `data`, its value under `[vary]` of a study file.

    A list gives Choices. A table with `mean` and `sd` gives a Normal distribution, and any other table a Range, both
    structured by `converter` from `file_converter`. Raises MisfitError for any other value.
    """
    if isinstance(data, list):
        return Choices(values=tuple(map(setting_of, data)))
    if not isinstance(data, Mapping):
        bound = "a list, or a table with from and to, or with mean and sd"
        raise MisfitError(data, bound, "see docs/studies.md")
    if data.keys() & {"mean", "sd"}:
        return converter.structure(data, Normal)
    return converter.structure(data, Range)
