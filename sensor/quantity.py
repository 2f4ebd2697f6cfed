"""Declarations of the fields of records: the unit and meaning of each number, and the checks of input values.

A field that a person sets also declares its bounds, and a hint that says what to do if a value is outside them.
"""

import dataclasses
import difflib
import functools
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import MISSING, Field, dataclass, field
from numbers import Integral, Real
from types import UnionType
from typing import Any, ClassVar, Self

STANDARD_GRAVITY = 9.80665  # [m/s^2], ISO 80000-3
_MAX_VALUE_LENGTH = 500  # maximum number of characters of a value in a message; longer than any path


class InputError(ValueError):
    """An input that cannot be used. The message is one line with the value, its bound and what to do.

    Attributes
    ----------
    field : str
        Name of the key or argument; empty if the error concerns several of them.
    value : object
        The invalid value.
    bound : str
        The condition that a valid value satisfies, as text.

    Examples
    --------
    >>> try:
    ...     twintip.load_design("paper", {"targets.NL": 0.9})
    ... except twintip.InputError as error:
    ...     print(error.field)
    targets.NL
    """

    def __init__(self, message: str, *, field: str = "", value: object = None, bound: str = "") -> None:
        """Store the message, and the field, value and bound that it describes."""
        super().__init__(message)
        self.field = field
        self.value = value
        self.bound = bound


@dataclass(frozen=True, kw_only=True)
class Bounds:
    """The allowed range of a number.

    The limits `above` and `below` are exclusive, `at_least` and `at_most` are inclusive.
    """

    above: float | None = None
    at_least: float | None = None
    below: float | None = None
    at_most: float | None = None

    def hold(self, value: float) -> bool:
        """Return whether a value, in the unit of the bounds, lies within the range; False for nan and infinity."""
        return (
            math.isfinite(value)
            and (self.above is None or value > self.above)
            and (self.at_least is None or value >= self.at_least)
            and (self.below is None or value < self.below)
            and (self.at_most is None or value <= self.at_most)
        )

    def __str__(self) -> str:
        """Return the bounds as text for messages, for example "greater than 0 and at most 1"."""
        limits = {
            "greater than": self.above,
            "at least": self.at_least,
            "less than": self.below,
            "at most": self.at_most,
        }
        parts = [f"{words} {limit:g}" for words, limit in limits.items() if limit is not None]
        return " and ".join(parts) or "finite"


@dataclass(frozen=True)
class Estimate:
    """A number with the half width of its error bar, both in the same unit."""

    value: float
    error: float
    unit: str = "1"

    @property
    def relative(self) -> float:
        """Return the error as a fraction of the value [1]; infinite for a value of 0 with a nonzero error."""
        if self.error == 0.0:
            return 0.0
        return self.error / abs(self.value) if self.value != 0.0 else math.inf

    @property
    def percent(self) -> float:
        """Return the error as a percentage of the value [%]."""
        return 100.0 * self.relative

    def times(self, factor: float, unit: str) -> "Estimate":
        """Return the estimate in another unit; `factor` is the number of new units per old unit."""
        return Estimate(factor * self.value, factor * self.error, unit)


COVERAGE = 2.0
"""Coverage factor for 95 %: half width of the interval in standard deviations, rounded (JCGM 100:2008, 6.3.3)."""
UNIFORM_DEVIATION = 1.0 / math.sqrt(3.0)
"""Standard deviation of a uniform distribution between -b and b, divided by b (JCGM 100:2008, 4.3.7)."""
# The lower limits exclude atomic lengths and the moduli of gases, for which the models do not hold.
LENGTH = Bounds(at_least=1e-6, at_most=1000.0)
MODULUS = Bounds(at_least=1e-6, at_most=1e6)
DURATION = Bounds(at_least=1e-3, at_most=1e6)


def quantity(
    unit: str,
    bounds: Bounds,
    *,
    hint: str = "",
    meaning: str = "",
    default: Any = MISSING,  # noqa: ANN401 - dataclasses.field takes any default
    **notes: object,
) -> Any:  # noqa: ANN401 - represents the value of the field
    """Declare a field of a record that holds one number or several, with its unit, bounds, hint and meaning.

    `hint` says what to do if a number is outside the bounds. If it is empty, the class attribute `HINT` of the record
    is used instead. `meaning` is the text of the field in the documentation. `notes` are further metadata. The note
    `key` is the name of the field in files, if it differs. The note `flag` is the command-line flag by which error
    messages name the field.
    """
    metadata = {"unit": unit, "bounds": bounds, "hint": hint, "meaning": meaning, **notes}
    return field(default=default, metadata=metadata)


def choice(
    options: Sequence[str],
    *,
    default: str | None,
    hint: str = "choose one of these",
    meaning: str = "",
    flag: str = "",
) -> Any:  # noqa: ANN401 - represents the value of the field
    """Declare a field of a record that holds one of the strings in `options`.

    `hint` says what to do about another value. `meaning` is the text of the field in the documentation. `flag`
    is the command-line flag by which error messages name the field, if it has one.
    """
    return field(default=default, metadata={"options": tuple(options), "hint": hint, "meaning": meaning, "flag": flag})


def text_field(
    *,
    hint: str = "",
    meaning: str = "",
    default: Any = MISSING,  # noqa: ANN401 - dataclasses.field takes any default
) -> Any:  # noqa: ANN401 - represents the value of the field
    """Declare a field of a record that holds one line of text, or a tuple of such lines."""
    return field(default=default, metadata={"text": "a line of text", "hint": hint, "meaning": meaning})


def report_field(
    unit: str,
    meaning: str,
    *,
    default: Any = MISSING,  # noqa: ANN401 - dataclasses.field takes any default
    default_factory: Any = MISSING,  # noqa: ANN401 - dataclasses.field takes any factory
    **notes: object,
) -> Any:  # noqa: ANN401 - represents the value of the field
    """Declare a field of a record that is a key of report.json, with its unit and meaning.

    The value of the field is not checked. The unit is "1" for a dimensionless number, and empty for a string, a Boolean
    or a table. `default` or `default_factory` is passed to `dataclasses.field`. `notes` are further metadata, which
    `pipeline/storage/record_data.py` lists.
    """
    metadata = {"unit": unit, "meaning": meaning, **notes}
    arguments: dict[str, Any] = {"default": default, "default_factory": default_factory, "metadata": metadata}
    return field(**arguments)


def key_of(item: Field[Any]) -> str:
    """Return the key of a field in files and JSON data: its declared `key`, or else the name of the field."""
    key: str = item.metadata.get("key", item.name)
    return key


def validation_error(name: str, value: object, unit: str, bound: str, hint: str) -> InputError:
    """Return an InputError whose message states in one sentence what is wrong, and in a second one what to do.

    `bound` completes the sentence "NAME = VALUE UNIT must be ...". `hint` is a clause that begins with a verb or states
    a typical value. A value of None means that the input is missing. The sentence is then "NAME is not set; it must be
    ...", or "NAME must be given ..." for a bound that begins with "given".
    """
    unit_suffix = "" if unit in ("", "1") else f" {unit}"
    if value is not None:
        subject = f"{name} = {_format_value(value)}{unit_suffix}"
    else:
        subject = name if bound.startswith("given") else f"{name} is not set; it"
    what_is_wrong = _end_sentence(f"{subject} must be {bound}")
    what_to_do = _end_sentence(_capitalise(hint))  # empty without a hint
    message = f"{what_is_wrong} {what_to_do}" if what_to_do else what_is_wrong
    return InputError(message, field=name, value=value, bound=bound)


def _end_sentence(text: str) -> str:
    """Return a text with a full stop, unless it is empty or already ends like a sentence."""
    return text if not text or text.endswith((".", "?", "!")) else f"{text}."


def _capitalise(clause: str) -> str:
    """Return a clause with a capital first letter, unless its first word is a key, a flag, a number or a command."""
    first_word = clause.partition(" ")[0].rstrip(",:;")
    return clause[:1].upper() + clause[1:] if first_word.isalpha() and first_word != "pipeline" else clause


def _format_value(value: object) -> str:
    """Return a value as one line of text; a number has enough digits to distinguish it from its bound."""
    if isinstance(value, float):
        short = f"{value:g}"
        return short if float(short) == value else repr(float(value))
    shown = repr(value) if isinstance(value, str) else f"{value}"
    return shown if len(shown) <= _MAX_VALUE_LENGTH else f"{shown[:_MAX_VALUE_LENGTH]}..."


def nearest(word: str, names: Sequence[str]) -> str:
    """Return the name that is most similar to a word, ignoring case; `names` are the candidates."""
    by_lower_case = {name.lower(): name for name in names}
    match = difflib.get_close_matches(word.lower(), list(by_lower_case), n=1, cutoff=0.0)
    return by_lower_case[match[0]]


def unknown_name(kind: str, name: str, names: Sequence[str], word: str | None = None) -> InputError:
    """Return an InputError for an unknown name. Its message lists the known `names` and suggests the most similar one.

    `kind` is the noun for such a name, for example "key". `word` is the unknown part of the name, by default all of it.
    """
    unknown = name if word is None else word
    printable_name = name if name.isprintable() else repr(name)
    bound = f"one of {', '.join(names)}"
    message = f"{printable_name} is an unknown {kind}; it must be {bound}. Did you mean {nearest(unknown, names)}?"
    return InputError(message, field=name, value=unknown, bound=bound)


def as_float(number: float) -> float:
    """Convert a number to a float; an integer that is too large becomes plus or minus infinity."""
    try:
        return float(number)
    except OverflowError:
        return math.inf if number > 0 else -math.inf


_NUMBER = re.compile(r"[+-]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][+-]?[0-9]{1,4})?")  # ASCII digits only, unlike \d


def parse_number(text: str) -> float | None:
    """Return the number that a string such as ".03", "3e-2" or "+1" represents, or None for any other string."""
    return float(text) if _NUMBER.fullmatch(text.strip()) else None


def python_numbers(value: Any) -> Any:  # noqa: ANN401 - returns a value of any type
    """Convert numbers of other libraries, such as NumPy, to the types of Python; return any other value unchanged.

    An array becomes a list. In a list or a tuple, each item is converted.
    """
    if value is None or type(value) in (float, int, bool, str):  # most values, so that the others cost no time
        return value
    if callable(getattr(value, "tolist", None)):  # a scalar or an array of NumPy, which is not imported for this
        return value.tolist()
    if isinstance(value, list | tuple):
        items = map(python_numbers, value)
        return list(items) if isinstance(value, list) else tuple(items)
    if isinstance(value, Integral):
        return int(value)
    return as_float(value) if isinstance(value, Real) else value  # type: ignore[arg-type]  # a Real has __float__


def check_fields(record: Any, table: str, excluded: Sequence[str] = ()) -> None:  # noqa: ANN401 - any frozen dataclass
    """Raise InputError for the first field of a record whose value does not satisfy its declaration.

    `table` is the name of the table that holds the keys of the record, or "". The fields in `excluded` are not checked.
    Before the check, numbers of NumPy in the record are replaced by numbers of Python, and lists and arrays by tuples.
    """
    for item, key, flag in _declared_fields(record.__class__):
        given = getattr(record, item.name)
        value = _stored_form(given, item)
        if value is not given:
            object.__setattr__(record, item.name, value)  # the record is frozen, but not yet in use
        is_omitted = value is None and item.default is None
        if item.name not in excluded and not is_omitted:
            hint = item.metadata["hint"] or record.HINT
            _check_field(flag or (f"{table}.{key}" if table else key), value, item, hint)


def _stored_form(value: object, item: Field[Any]) -> object:
    """Return a value as its field `item` stores it: Python's numbers, and a tuple where the field allows one."""
    if "bounds" not in item.metadata:
        return value
    numbers = python_numbers(value)
    return tuple(numbers) if isinstance(numbers, list) and "tuple" in str(item.type) else numbers


@functools.cache
def _declared_fields(record_type: type) -> tuple[tuple[Field[Any], str, str], ...]:
    """Return the fields of a record type that are to be checked, each with its key in files and its flag.

    The result is cached, because a study checks millions of records.
    """
    checked = (item for item in dataclasses.fields(record_type) if "hint" in item.metadata)
    return tuple((item, key_of(item), item.metadata.get("flag", "")) for item in checked)


def check_choice(name: str, value: object, record_type: type[Any]) -> None:
    """Raise InputError unless a value is one of the options of a field.

    `name` is TABLE.KEY, and `record_type` is the class of records that declares the field.
    """
    key = name.rpartition(".")[2]
    item = record_type.__dataclass_fields__[key]
    _check_field(name, value, item, item.metadata["hint"])


def _check_field(name: str, value: object, item: Field[Any], hint: str) -> None:
    """Raise InputError if a value does not satisfy the declaration of its field `item`.

    `name` is the name of the field in the error message, and `hint` says there what to do.
    """
    # `text_field` declares a text, `choice` declares options, and `quantity` declares neither of them.
    if "text" in item.metadata:
        _check_texts(name, value, item, hint)
    elif "options" in item.metadata:
        options = item.metadata["options"]
        if value not in options:
            suggestion = f". Did you mean {nearest(value, options)}?" if isinstance(value, str) else ""
            raise validation_error(name, value, "", f"one of {', '.join(options)}", hint + suggestion)
    else:
        _check_numbers(name, value, item, hint)


def _check_texts(name: str, value: object, item: Field[Any], hint: str) -> None:
    """Raise InputError unless a value is one line of text or, for a field annotated as tuple, a tuple of such lines."""
    bound = item.metadata["text"]
    texts: tuple[object, ...] = (value,)
    if str(item.type).startswith("tuple"):
        bound = "a list of strings"
        texts = value if isinstance(value, tuple) else (None,)
    for text in texts:
        if not isinstance(text, str) or not text.strip() or not text.isprintable():
            raise validation_error(name, value, "", bound, hint)


def _check_numbers(name: str, value: object, item: Field[Any], hint: str) -> None:
    """Raise InputError for the first value of a field that is not a number or is outside its bounds.

    The annotation "tuple[float, ...]" of a field requires a list, and "float | tuple[float, ...]" allows one. A Boolean
    is refused, although Python treats it as an integer. `name` is the name of the field in the error message, and
    `hint` says there what to do.
    """
    unit = item.metadata["unit"]
    bounds = item.metadata["bounds"]
    annotation = str(item.type)
    requires_list = annotation.startswith("tuple")
    allows_list = "tuple" in annotation
    entries = value if isinstance(value, tuple) and value else None  # an empty list has no entries
    if requires_list and entries is None:
        raise validation_error(name, value, unit, f"a list of at least one number, each {bounds}", hint)
    # A list in a field that does not allow one is checked as one value, and refused because it is not a number.
    numbers = (value,) if entries is None or not allows_list else entries
    for number in numbers:
        check_number(name, number, unit, bounds, hint, whole=item.type in (int, int | None))


def check_number(name: str, number: object, unit: str, bounds: Bounds, hint: str, *, whole: bool = False) -> None:
    """Raise InputError for a value that is not a number or is outside its bounds, and with `whole` for a fraction."""
    if isinstance(number, bool) or not isinstance(number, int | float):
        # A number without an upper and a lower bound must only be finite.
        bound = f"a number {bounds}" if str(bounds) != str(Bounds()) else "a finite number"
        raise validation_error(name, number, unit, bound, hint)
    if whole and not isinstance(number, int):
        raise validation_error(name, number, unit, f"a whole number {bounds}", hint)
    if not bounds.hold(as_float(number)):
        raise validation_error(name, as_float(number), unit, str(bounds), hint)


def check_type(name: str, value: object, kind: type | UnionType, bound: str, hint: str) -> None:
    """Raise InputError for an argument that is not of the type `kind`; `bound` describes this type."""
    if not isinstance(value, kind):
        shown = value if value is None or isinstance(value, str | int | float) else type(value).__name__
        raise validation_error(name, shown, "", bound, hint)


@dataclass(frozen=True, kw_only=True)
class Sourced:
    """A record of published data, such as a print process or a fruit, in which each number has exactly one source."""

    LABEL: ClassVar[str]
    """The noun for such a record in error messages."""
    HINT: ClassVar[str] = "correct its entry in the data"

    name: str
    sources: tuple[tuple[str, str], ...] = dataclasses.field(repr=False)  # pairs of a field name and its source

    def __post_init__(self) -> None:
        """Raise InputError for an invalid field, a number without a source or a source without a number."""
        table = f"{self.LABEL} {self.name}"
        check_fields(self, table)
        names = [item.name for item in dataclasses.fields(self) if "unit" in item.metadata]
        set_names = {name for name in names if getattr(self, name) is not None}
        for key in sorted(set_names ^ dict(self.sources).keys()):  # names in only one of the two sets
            name = f"{table}.{key}"
            raise validation_error(name, getattr(self, key, None), "", "a number with one source", self.HINT)

    @classmethod
    def from_table(cls, name: str, table: object) -> Self:
        """Return the record with this name, given a table of its numbers that contains a table `sources`.

        `sources` maps the key of each number to its source. Raises InputError for an unknown key, an invalid value or a
        number without a source.
        """
        record = f"{cls.LABEL} {name}"  # the name of the record in messages, for example "fruit mango"
        if not isinstance(table, Mapping) or not isinstance(table.get("sources", {}), Mapping):
            bound = "a table of numbers that contains a table of their sources"
            raise validation_error(record, str(table), "", bound, cls.HINT)
        fields = dataclasses.fields(cls)
        keys = [item.name for item in fields if item.name != "name"]
        for key in sorted(table.keys() - keys):
            unknown_key = f"{record}.{key}"
            hint = f"{cls.HINT}. Did you mean {nearest(key, keys)}?"
            raise validation_error(unknown_key, table[key], "", "left out", hint)
        # A missing number is set to None, so that the check of its field reports it by name.
        missing = dict.fromkeys(item.name for item in fields if item.default is MISSING)
        sources = tuple(table.get("sources", {}).items())
        # Lists become tuples, because a record is immutable.
        values: dict[str, Any] = {
            key: tuple(value) if isinstance(value, list) else value for key, value in table.items()
        }
        return cls(**{**missing, **values, "name": name, "sources": sources})

    @classmethod
    def from_tables(cls, tables: Mapping[str, object]) -> dict[str, Self]:
        """Return the record of each name, given the table of each name. Raises InputError like `from_table`."""
        return {name: cls.from_table(name, table) for name, table in tables.items()}
