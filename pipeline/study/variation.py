"""How one key of a design varies over the points of a study: over a range, a list, or a distribution."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, TypeGuard

from scipy.special import ndtri

from sensor.design.design_file import parsed_setting
from sensor.quantity import Bounds, InputError, as_float, nearest, validation_error

Setting = float | int | str | bool | tuple[float, ...]

_SPAN_KEYS = ("from", "to", "steps", "log", "distribution", "source")
_NORMAL_KEYS = ("mean", "sd", "source")
_STEPS = Bounds(at_least=2, at_most=10_000)
_TAIL = 1e-9  # of a normal distribution, beyond which no point lies: 6 standard deviations


@dataclass(frozen=True, kw_only=True)
class Range:
    """Numbers between two ends, both included, in equal steps or in equal ratios [unit of the key].

    `steps` is how many numbers a grid takes. A span with a `source` is a uniform distribution, and the source says
    where its ends are from.
    """

    low: float
    high: float
    steps: int | None = None
    log: bool = False
    source: str | None = None

    def __post_init__(self) -> None:
        """Refuse ends that leave nothing between them, and steps that are none."""
        if not self.low < self.high:
            bound = f"greater than from = {self.low:g}"
            raise validation_error("to", self.high, "", bound, "give a range of some width")
        if self.log and self.low <= 0.0:
            raise validation_error("from", self.low, "", "greater than 0 with log = true", "leave log out")
        if self.steps is not None and (type(self.steps) is not int or not _STEPS.hold(self.steps)):
            bound = f"a whole number {_STEPS}"
            raise validation_error("steps", self.steps, "", bound, "count both ends of the range")

    def at(self, fraction: float) -> float:
        """Return the number that a fraction [1] of the span, or of the distribution, lies below [unit of the key]."""
        if self.log:
            return self.low * math.pow(self.high / self.low, fraction)
        return self.low + (self.high - self.low) * fraction

    def fraction_of(self, value: object) -> float | None:
        """Return the fraction [1] of the span that lies below a number [unit of the key]; None for any other value."""
        if not is_number(value) or not self.low <= value <= self.high:
            return None
        if self.log:
            return math.log(value / self.low) / math.log(self.high / self.low)
        return (value - self.low) / (self.high - self.low)

    def grid(self) -> tuple[Setting, ...]:
        """Return the numbers of a grid [unit of the key]; raises InputError where no steps were given."""
        if self.steps is None:
            hint = "say how many values to take, both ends counted"
            raise validation_error("steps", None, "", "given with how = 'grid'", hint)
        return tuple(self.at(i / (self.steps - 1)) for i in range(self.steps))


@dataclass(frozen=True, kw_only=True)
class Choices:
    """The values of a list, numbers or words; by Sobol points each takes an equal fraction."""

    values: tuple[Setting, ...]

    def __post_init__(self) -> None:
        """Refuse an empty list."""
        if not self.values:
            raise validation_error("values", "[]", "", "a list of at least one value", "write at least one value")

    def at(self, fraction: float) -> Setting:
        """Return the value that a fraction [1] from 0 to 1 falls on [unit of the key]."""
        return self.values[min(int(fraction * len(self.values)), len(self.values) - 1)]

    def fraction_of(self, value: object) -> float | None:
        """Return the middle of the fractions [1] that fall on a value; None for one that is not in the list."""
        if value not in self.values:
            return None
        return (self.values.index(value) + 0.5) / len(self.values)

    def grid(self) -> tuple[Setting, ...]:
        """Return all values."""
        return self.values


@dataclass(frozen=True, kw_only=True)
class Normal:
    """A normal distribution of a mean and a standard deviation [unit of the key], and the source of both."""

    mean: float
    sd: float
    source: str

    def __post_init__(self) -> None:
        """Refuse a deviation that is none."""
        if self.sd <= 0.0:
            raise validation_error("sd", self.sd, "", "greater than 0", "give one value where nothing scatters")

    def at(self, fraction: float) -> float:
        """Return the number that a fraction [1] of the distribution lies below [unit of the key]."""
        return self.mean + self.sd * float(ndtri(min(max(fraction, _TAIL), 1.0 - _TAIL)))

    def grid(self) -> tuple[Setting, ...]:
        """Raise InputError: a distribution has no grid."""
        bound = "sobol where a key has a distribution"
        raise validation_error("how", "grid", "", bound, "set how = 'sobol' and samples")


Variation = Range | Choices | Normal


def setting_of(value: object) -> Setting:
    """Return a value of TOML as one that a key of a design can have; raises InputError for dates, tables and nan."""
    numbers = value if isinstance(value, list) and value else [value]
    if isinstance(value, bool | str) or all(map(_is_finite, numbers)):
        return tuple(value) if isinstance(value, list) else value  # type: ignore[return-value]
    bound = "a finite number, a list of such, a truth value or text"
    raise validation_error("value", str(value), "", bound, "correct that value")


def is_number(value: object) -> TypeGuard[float]:
    """Say whether a value is a number: a truth value, which is an int to Python, is none."""
    return isinstance(value, int | float) and not isinstance(value, bool)


def _is_finite(value: object) -> bool:
    return is_number(value) and math.isfinite(as_float(value))


def setting_of_cell(key: str, cell: str) -> Setting:
    """Return the value of a cell in the column of a key: a number or a truth value as TOML writes it, else text."""
    try:
        return setting_of(parsed_setting(cell))
    except InputError as error:
        name = f"points {key}"
        raise _under(name, error) from error


def variation(key: str, given: object) -> Variation:
    """Return the variation of a key in a study file; raises InputError that names the key.

    A list is taken as it is; a table has `from` and `to` with `steps` or `log`, or `mean` and `sd`. A distribution, of
    `mean` and `sd` or `distribution = "uniform"`, names its `source`.
    """
    try:
        if isinstance(given, list):
            return Choices(values=tuple(setting_of(value) for value in given))
        if isinstance(given, Mapping):
            return _range_or_distribution(given)
        bound = "a list, or a table with from and to, or with mean and sd"
        raise validation_error("value", str(given), "", bound, "see docs/studies.md")
    except InputError as error:
        name = f"vary {key}"
        raise _under(name, error) from error


def _under(name: str, error: InputError) -> InputError:
    """Return an error with the name of what it is about before it."""
    return InputError(f"{name}: {error}", field=error.field, value=error.value, bound=error.bound)


def _range_or_distribution(table: Mapping[str, Any]) -> Range | Normal:
    """Return the range or the distribution of a table; raises InputError for unknown keys and a missing source."""
    is_normal = "mean" in table or "sd" in table
    known = _NORMAL_KEYS if is_normal else _SPAN_KEYS
    for key, value in table.items():
        if key not in known:
            bound = f"one of {', '.join(known)}"
            raise validation_error(key, str(value), "", bound, f"did you mean {nearest(key, known)}?")
    if table.get("distribution", "uniform") != "uniform":
        given = str(table["distribution"])
        raise validation_error("distribution", given, "", "uniform", "give a normal distribution by mean and sd")
    source = table.get("source")
    has_source = isinstance(source, str) and bool(source.strip())
    if (is_normal or "distribution" in table) and not has_source:
        raise validation_error("source", source, "", "given with a distribution", "say where its numbers are from")
    if is_normal:
        return Normal(mean=_number(table, "mean"), sd=_number(table, "sd"), source=str(source))
    log = table.get("log", False)
    if not isinstance(log, bool):
        raise validation_error("log", str(log), "", "true or false", "write true to space the values by equal ratios")
    low = _number(table, "from")
    return Range(low=low, high=_number(table, "to"), steps=table.get("steps"), log=log, source=source)


def _number(table: Mapping[str, Any], key: str) -> float:
    value = table.get(key)
    if not _is_finite(value):
        raise validation_error(key, value, "", "a finite number", "give from and to, or mean and sd")
    return as_float(table[key])
