"""The variation of a design key between the points of a study: a range, a list of values, or a distribution."""

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

_TAIL = 1e-9  # probability of each tail of a normal distribution that is cut off, 6 standard deviations from the mean
# Hints for the user
_BOTH = "give from and to, or mean and sd"
_SOURCE = "state the source of the numbers"


@dataclass(frozen=True, kw_only=True)
class Range:
    """A range of numbers from `low` to `high` [unit of the key], divided linearly, or logarithmically with `log`.

    `steps` is the number of values in a grid, including both ends. With a `distribution`, the key is a random variable,
    and `source` must cite the origin of both ends.
    """

    low: float = quantity("", Bounds(), hint=_BOTH, key="from")
    high: float = quantity("", Bounds(), hint=_BOTH, key="to")
    steps: int | None = quantity(
        "", Bounds(at_least=2, at_most=10_000), default=None, hint="count the values, including both ends of the range"
    )
    log: bool = False
    distribution: str | None = choice(("uniform",), default=None, hint="define a normal distribution by mean and sd")
    source: str | None = text_field(default=None, hint=_SOURCE)

    def __post_init__(self) -> None:
        """Raise InputError for an empty range, invalid steps, or a distribution without a source."""
        check_fields(self, "")
        if not self.low < self.high:
            bound = f"greater than from = {self.low:g}"
            raise validation_error("to", self.high, "", bound, "swap the ends, or give a list with one value")
        if self.log and self.low <= 0.0:
            raise validation_error("from", self.low, "", "greater than 0 with log = true", "leave out log")
        if self.distribution is not None and self.source is None:
            raise validation_error("source", None, "", "given with a distribution", _SOURCE)

    def at(self, fraction: float) -> float:
        """Return the number [unit of the key] at a fraction [1] of the range, from 0 at `low` to 1 at `high`."""
        if self.log:
            return self.low * math.pow(self.high / self.low, fraction)
        return self.low + (self.high - self.low) * fraction

    def fraction_of(self, value: object) -> float | None:
        """Return the fraction [1] of the range at which a number [unit of the key] lies; this is the inverse of `at`.

        Returns None for a number outside the range, and for a value that is not a number.
        """
        if not is_number(value) or not self.low <= value <= self.high:
            return None
        if self.log:
            return math.log(value / self.low) / math.log(self.high / self.low)
        return (value - self.low) / (self.high - self.low)

    def grid(self) -> tuple[Setting, ...]:
        """Return the numbers of a grid [unit of the key]; raises InputError if the range has no `steps`."""
        if self.steps is None:
            hint = "give the number of values, including both ends"
            raise validation_error("steps", None, "", "given with how = 'grid'", hint)
        return tuple(self.at(i / (self.steps - 1)) for i in range(self.steps))


@dataclass(frozen=True, kw_only=True)
class Choices:
    """A list of numbers or strings; each value gets an equal share of the Sobol points."""

    values: tuple[Setting, ...]

    def __post_init__(self) -> None:
        """Raise InputError for an empty list."""
        if not self.values:
            raise validation_error("values", "[]", "", "a list of at least one value", "write at least one value")

    def at(self, fraction: float) -> Setting:
        """Return the value [unit of the key] at a fraction [1] of the list, from 0 at its start to 1 at its end."""
        # The fraction 1 would give an index beyond the end, so the index is limited.
        return self.values[min(int(fraction * len(self.values)), len(self.values) - 1)]

    def fraction_of(self, value: object) -> float | None:
        """Return the middle of the interval of fractions [1] at which a value lies; None if it is not in the list."""
        if value not in self.values:
            return None
        return (self.values.index(value) + 0.5) / len(self.values)

    def grid(self) -> tuple[Setting, ...]:
        """Return all values, because a grid contains each of them."""
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
        """Return the quantile [unit of the key] of the distribution at a probability `fraction` [1]."""
        return self.mean + self.sd * float(ndtri(min(max(fraction, _TAIL), 1.0 - _TAIL)))

    def grid(self) -> tuple[Setting, ...]:
        """Raise InputError, because a distribution has no grid."""
        bound = "sobol if a key has a distribution"
        raise validation_error("how", "grid", "", bound, "set how = 'sobol' and samples")


Variation = Range | Choices | Normal


def setting_of(value: object) -> Setting:
    """Convert a TOML value to a value of a design key; a list becomes a tuple.

    Raises MisfitError for a date, a table, an empty list, a list with an item that is not a number, infinity and NaN.
    """
    items = value if isinstance(value, list) else [value]
    are_finite_numbers = bool(items) and all(is_number(item) and math.isfinite(as_float(item)) for item in items)
    if isinstance(value, bool | str) or are_finite_numbers:
        return tuple(value) if isinstance(value, list) else value  # type: ignore[return-value]
    bound = "a finite number, a list of finite numbers, true or false, or a string"
    raise MisfitError(value, bound, "correct that value")


def is_number(value: object) -> TypeGuard[float]:
    """Return whether a value is a number; a Boolean is not, although bool is a subclass of int in Python."""
    return isinstance(value, int | float) and not isinstance(value, bool)


def setting_of_cell(key: str, cell: str) -> Setting:
    """Return the value of a cell in the column of a key.

    A number or Boolean in TOML notation is parsed, and any other cell is a string. Raises InputError for another TOML
    value, such as a date.
    """
    try:
        return setting_of(parse_setting(cell))
    except MisfitError as error:
        name = f"points.{key}"
        raise error.named(name) from error


def variation_of(data: object, converter: cattrs.Converter) -> Variation:
    """Return the variation of a key; `data` is its value under `[vary]` in a study file.

    A list becomes Choices, a table with `mean` or `sd` becomes a Normal distribution, and any other table becomes a
    Range. `converter`, which comes from `file_converter`, converts the tables and rejects unknown keys. Raises
    MisfitError for a value that is neither a list nor a table.
    """
    if isinstance(data, list):
        return Choices(values=tuple(map(setting_of, data)))
    if not isinstance(data, Mapping):
        bound = "a list, or a table with from and to, or with mean and sd"
        raise MisfitError(data, bound, "see docs/studies.md")
    if data.keys() & {"mean", "sd"}:
        return converter.structure(data, Normal)
    return converter.structure(data, Range)
