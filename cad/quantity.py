"""A number that a person may choose: its unit and its bounds, stated once beside the field."""

import dataclasses
import difflib
import functools
import math
import tomllib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import MISSING, Field, dataclass, field
from pathlib import Path
from typing import Any, TypeVar

Record = TypeVar("Record")


class InputError(ValueError):
    """An input that cannot be used; the message is one line: name, value, unit, bound, hint.

    `field`, `value` and `bound` say the same to code; they are empty where the error is about no single field.
    """

    def __init__(self, message: str, *, field: str = "", value: object = None, bound: str = "") -> None:
        """Take the line, and what it is about."""
        super().__init__(message)
        self.field = field
        self.value = value
        self.bound = bound


@dataclass(frozen=True, kw_only=True)
class Bounds:
    """Where a number may lie: open below at `above`, closed at `at_least`, and likewise above."""

    above: float | None = None
    at_least: float | None = None
    below: float | None = None
    at_most: float | None = None

    def hold(self, value: float) -> bool:
        """Say whether a value [unit of the bounds] lies inside; nan never does."""
        return (
            math.isfinite(value)
            and (self.above is None or value > self.above)
            and (self.at_least is None or value >= self.at_least)
            and (self.below is None or value < self.below)
            and (self.at_most is None or value <= self.at_most)
        )

    def __str__(self) -> str:
        """Return the bound in words."""
        parts = [
            f"{words} {limit:g}"
            for words, limit in (
                ("greater than", self.above),
                ("at least", self.at_least),
                ("less than", self.below),
                ("at most", self.at_most),
            )
            if limit is not None
        ]
        return " and ".join(parts) or "finite"


@dataclass(frozen=True)
class Estimate:
    """A number with the half width of its error bar, both in one unit."""

    value: float
    error: float
    unit: str = "1"

    @property
    def relative(self) -> float:
        """Return the error as a share of the value [1]; infinite for a value of 0 that is not exact."""
        if self.error == 0.0:
            return 0.0
        return self.error / abs(self.value) if self.value != 0.0 else math.inf

    @property
    def percent(self) -> float:
        """Return the error as a share of the value [%]."""
        return 100.0 * self.relative

    def times(self, factor: float, unit: str) -> "Estimate":
        """Return the estimate in another unit, of which one of this unit has `factor`."""
        return Estimate(factor * self.value, factor * self.error, unit)


# Below, a length is one of atoms and a modulus that of a gas: nothing that these models solve.
COVERAGE = 2.0
"""Standard deviations to each side that hold 95 % of a normal distribution, rounded: JCGM 100:2008, 6.3.3."""
LENGTH = Bounds(at_least=1e-6, at_most=1000.0)
MODULUS = Bounds(at_least=1e-6, at_most=1e6)


def quantity(
    unit: str,
    bounds: Bounds,
    *,
    remedy: str,
    default: Any = MISSING,  # noqa: ANN401 - dataclasses.field takes any default
) -> Any:  # noqa: ANN401 - stands where a field's value will stand
    """Declare a number field with its unit, its bounds and what to do when it lies outside."""
    return field(default=default, metadata={"unit": unit, "bounds": bounds, "remedy": remedy})


def choice(options: Sequence[str], *, default: str | None, remedy: str = "choose one of these") -> Any:  # noqa: ANN401
    """Declare a text field that must be one of the options."""
    return field(default=default, metadata={"options": tuple(options), "remedy": remedy})


def text_field(
    *,
    remedy: str,
    default: Any = MISSING,  # noqa: ANN401 - dataclasses.field takes any default
) -> Any:  # noqa: ANN401 - stands where a field's value will stand
    """Declare a field of free text on one line, and what to do when it is none."""
    return field(default=default, metadata={"text": "a line of text", "remedy": remedy})


def validation_error(name: str, value: object, unit: str, bound: str, remedy: str) -> InputError:
    """Return the error for one bad value, in the one form that every message has."""
    in_unit = "" if unit in ("", "1") else f" {unit}"
    message = f"{name} = {_shown(value)}{in_unit}: must be {bound}; {remedy}"
    return InputError(message, field=name, value=value, bound=bound)


def _shown(value: object) -> str:
    """Write a number with the digits that tell it from its bound, and text so that it stays on one line."""
    if isinstance(value, float):
        short = f"{value:g}"
        return short if float(short) == value else repr(float(value))
    return repr(value) if isinstance(value, str) else f"{value}"


def nearest(word: str, known: Sequence[str]) -> str:
    """Return the known word that looks most like a given one."""
    return difflib.get_close_matches(word, known, n=1, cutoff=0.0)[0]


def as_float(number: float) -> float:
    """Return a number as a float [same unit]; a whole number too large for one is infinite."""
    try:
        return float(number)
    except OverflowError:
        return math.inf if number > 0 else -math.inf


def check_fields(record: Any, table: str, but: Sequence[str] = ()) -> None:  # noqa: ANN401 - any frozen dataclass
    """Check every declared field of a frozen record but the named ones; raises InputError at the first bad one."""
    for item in _declared(record.__class__):
        value = getattr(record, item.name)
        if item.name in but or (value is None and item.default is None):
            continue
        if "text" in item.metadata:
            _check_text(f"{table}.{item.name}", value, item)
        elif "options" in item.metadata:
            _check_choice(f"{table}.{item.name}", value, item)
        else:
            _check_number(f"{table}.{item.name}", value, item)


@functools.cache
def _declared(kind: type) -> tuple[Field[Any], ...]:
    """Return the fields of a record type that say what they may hold, looked up once: studies check millions."""
    checked = {"text", "options", "bounds"}
    return tuple(item for item in dataclasses.fields(kind) if checked & item.metadata.keys())


def check_sources(record: Any, table: str, remedy: str) -> None:  # noqa: ANN401 - any frozen dataclass with `sources`
    """Raise InputError unless every number that a record gives has one source, and every source its number."""
    numbers = [item.name for item in dataclasses.fields(record) if "unit" in item.metadata]
    given = {name for name in numbers if getattr(record, name) is not None}
    for key in sorted(given ^ dict(record.sources).keys()):
        name, value = f"{table}.{key}", getattr(record, key, None)
        raise validation_error(name, value, "", "a number with one source", remedy)


def sourced_records(path: Path, kind: type[Record], label: str, remedy: str) -> dict[str, Record]:
    """Return by name the records with `sources` of a TOML file; raises InputError for an unknown or bad key."""
    tables = tomllib.loads(path.read_text(encoding="utf-8"))
    return {name: sourced_record(name, table, kind, label, remedy) for name, table in tables.items()}


def sourced_record(name: str, table: object, kind: type[Record], label: str, remedy: str) -> Record:
    """Return the record of one table with its `sources`; raises InputError for an unknown or bad key."""
    if not isinstance(table, Mapping) or not isinstance(table.get("sources", {}), Mapping):
        shown, bound = f"{label} {name}", "a table of numbers with a table of their sources"
        raise validation_error(shown, str(table), "", bound, remedy)
    fields = dataclasses.fields(kind)  # type: ignore[arg-type]
    keys = [item.name for item in fields if item.name != "name"]
    left_out = dict.fromkeys(item.name for item in fields if item.default is MISSING)
    for key in sorted(table.keys() - keys):
        shown, bound = f"{label} {name}.{key}", f"left out; did you mean {nearest(key, keys)}?"
        raise validation_error(shown, table[key], "", bound, remedy)
    sources = tuple(table.get("sources", {}).items())
    return kind(**{**left_out, **table, "name": name, "sources": sources})


def _check_text(name: str, value: object, item: Field[Any]) -> None:
    if not isinstance(value, str) or not value.strip() or not value.isprintable():
        raise validation_error(name, value, "", item.metadata["text"], item.metadata["remedy"])


def check_choice(name: str, value: object, kind: type[Any]) -> None:
    """Raise InputError unless a value is one of the options of the field `table.key` of a record type."""
    key = name.rpartition(".")[2]
    _check_choice(name, value, next(item for item in dataclasses.fields(kind) if item.name == key))


def _check_choice(name: str, value: object, item: Field[Any]) -> None:
    options = item.metadata["options"]
    if value not in options:
        closest = f", did you mean {nearest(value, options)}?" if isinstance(value, str) else ""
        raise validation_error(name, value, "", f"one of {', '.join(options)}", item.metadata["remedy"] + closest)


def _check_number(name: str, value: object, item: Field[Any]) -> None:
    unit, bounds, remedy = (item.metadata[key] for key in ("unit", "bounds", "remedy"))
    kind = str(item.type)
    is_list = kind.startswith("tuple") or ("tuple" in kind and isinstance(value, tuple))
    if is_list and (not isinstance(value, tuple) or not value):
        raise validation_error(name, value, unit, f"a list of at least one number, each {bounds}", remedy)
    numbers: Iterable[object] = value if is_list and isinstance(value, tuple) else (value,)
    for number in numbers:
        if isinstance(number, bool) or not isinstance(number, int | float):
            raise validation_error(name, number, unit, f"a number {bounds}", remedy)
        if not bounds.hold(as_float(number)):
            raise validation_error(name, as_float(number), unit, str(bounds), remedy)
