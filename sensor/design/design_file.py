"""Read designs and single settings from TOML, and write designs as TOML."""

import dataclasses
import json
from collections.abc import Mapping, Sequence
from typing import Any

from sensor.design.bench import Bench
from sensor.design.fruit import Fruit
from sensor.design.parameters import TABLES, Design, GivenSprings, Print, Targets
from sensor.design.processes import Process, parse_process, process_as_table
from sensor.design.reading import ReadingRequirements
from sensor.design.readout import Readout
from sensor.design.tips import PressMotion, Tips
from sensor.gone import drop_ineffective_keys, refuse_removed
from sensor.input_file import parse_toml
from sensor.quantity import InputError, as_float, parse_number, unknown_name, validation_error

TABLE_TYPES: dict[str, Any] = {
    "targets": Targets,
    "springs": GivenSprings,
    "fruit": Fruit,
    "tips": Tips,
    "press": PressMotion,
    "reading": ReadingRequirements,
    "readout": Readout,
    "bench": Bench,
    "print": Print,
}


def not_a_table(name: str, value: object) -> InputError:
    """Return the error for a key whose value must be a table."""
    message = f"{name} = {value} must be a table. Write [{name}] and its keys below it."
    return InputError(message, field=name, value=value, bound="a table")


def design_from_mapping(data: Mapping[str, Any]) -> Design:
    """Build a design from nested tables, as in a design file.

    A table may also be given as a record, such as `Fruit` for the table "fruit". A design without a name is called
    "paper", because the default values describe the sensor of the paper. Raises InputError for an unknown key or an
    invalid value.
    """
    for key in data:
        if key != "name" and key not in TABLES:
            raise unknown_name("table", key, ["name", *TABLES])
    name = data.get("name", "paper")
    if not isinstance(name, str):
        raise validation_error("name", name, "", "text", "choose a name that can be part of a file name")
    tables = {table: table_as_record(table, data[table]) for table in TABLE_TYPES if table in data}
    if "readout" in data:
        refuse_given_noise(data.get("reading"))
    if "printer" in data:
        tables["printer"] = _custom_process(tables.get("print", Print()), data["printer"])
    if "springs" in tables and tables["springs"].given:
        tables.setdefault("targets", None)  # given springs need no targets to size them
    return Design(name=name, **tables)


_NOISE_KEYS = ("noise_percent", "noise_N")  # keys of [reading] whose values are computed if a design has [readout]


def refuse_given_noise(reading: object) -> None:
    """Raise InputError if the table [reading] gives a noise although the design has [readout].

    The noise of such a design is computed, so it must not be given.
    """
    for key in _NOISE_KEYS:
        if isinstance(reading, Mapping) and key in reading:
            bound = "left out if [readout] is given, because the noise is then computed"
            name = f"reading.{key}"
            raise validation_error(name, reading[key], "", bound, "drop one of the two")


def _custom_process(print_table: Print, table: object) -> Process:
    """Return the custom process that the table [printer] defines, with `print.process` as its name.

    Raises InputError for an invalid name, an unknown key or an invalid number.
    """
    frozen = {key: _freeze(value) for key, value in table.items()} if isinstance(table, Mapping) else table
    return parse_process(print_table.process, frozen)


def table_as_record(table: str, values: object) -> Any:  # noqa: ANN401 - one of the parameter tables
    """Convert the keys and values of a table to the record of this table. A record is returned unchanged.

    Raises InputError for an unknown key or an invalid value.
    """
    if isinstance(values, TABLE_TYPES[table]):
        return values
    if not isinstance(values, Mapping):
        raise not_a_table(table, values)
    record_type = TABLE_TYPES[table]
    known_keys = [item.name for item in dataclasses.fields(record_type)]
    # Keys of earlier versions are dropped if they had no effect, and refused otherwise.
    effective_values = drop_ineffective_keys(table, values)
    refuse_removed(*(f"{table}.{key}" for key in effective_values))
    for key in effective_values:
        if key not in known_keys:
            raise unknown_name("key", f"{table}.{key}", known_keys, key)
    return record_type(**{key: _freeze(value) for key, value in effective_values.items()})


def _freeze(value: object) -> object:
    """Convert a value of a table to the form that records hold: tuples for lists, and floats for integers."""
    if isinstance(value, list | tuple):
        return tuple(_freeze(item) for item in value)
    return as_float(value) if isinstance(value, int) and not isinstance(value, bool) else value


def every_key() -> list[str]:
    """Return the name of every key of a design file, TABLE.KEY."""
    return [f"{table}.{item.name}" for table, kind in TABLE_TYPES.items() for item in dataclasses.fields(kind)]


def parse_setting(text: str) -> object:
    """Return the value of a setting, which is written as a TOML value or as a number in everyday notation.

    Any other text, such as a word without quotes, is returned unchanged.
    """
    if not text.isprintable():  # a line break would end the value and begin another key
        return text
    try:
        return parse_toml(f"value = {text}")["value"]
    except ValueError:  # a word without quotes, or a number that is not valid TOML or has too many digits
        number = parse_number(text)
        return text if number is None else number


_TIPS_FIRST = (
    *("layout", "order", "outer_mm", "shape", "dome_radius_mm", "side_mm", "fillet_mm"),
    *("spacing_mm", "offset_mm", "gap_mm", "socket"),
)


def design_as_mapping(design: Design, *, derived: bool = False) -> dict[str, Any]:
    """Return the design as nested tables of plain values, without the keys that are not set.

    `design_from_mapping` builds the same design from them. The length and width of a whole fruit follow from other
    keys, so they are included only if `derived` is true.
    """
    derived_keys = [] if derived else [f"fruit.{key}" for key in design.fruit.derived_keys]
    tables: dict[str, Any] = {"name": design.name}
    for table in TABLES:
        record = getattr(design, table)
        if isinstance(record, Process):
            tables[table] = process_as_table(record)
        elif record is not None:
            tables[table] = _record_as_table(table, record, derived_keys)
    # If there is a read-out, the noise is computed. A file with both is rejected, even if it has the default noise.
    if design.readout is not None and "reading" in tables:
        tables["reading"] = {key: value for key, value in tables["reading"].items() if key not in _NOISE_KEYS}
    return tables


def _record_as_table(table: str, record: Any, omitted: Sequence[str]) -> dict[str, Any]:  # noqa: ANN401 - any record
    """Return the keys of a record with their plain values: lists for tuples, and no key that is not set.

    `table` is the name of the record's table. The names TABLE.KEY in `omitted` are left out too.
    """
    keys = [item.name for item in dataclasses.fields(record)]
    if table == "tips":
        keys = sorted(keys, key=_tips_order)
    values = {}
    for key in keys:
        value = getattr(record, key)
        if value is not None and f"{table}.{key}" not in omitted:
            values[key] = list(value) if isinstance(value, tuple) else value
    return values


def _tips_order(key: str) -> int:
    """Return the sort position of a key of [tips]: the layout and the shape come first, the keys of later shapes last.

    The digest in a unit.toml is computed from the text in this order, so the order must not change.
    """
    return _TIPS_FIRST.index(key) if key in _TIPS_FIRST else len(_TIPS_FIRST)


def design_as_toml(design: Design) -> str:
    """Return the design as TOML text, from which the same design can be read."""
    return tables_as_toml(design_as_mapping(design))


def tables_as_toml(data: Mapping[str, Any]) -> str:
    """Return keys and tables, for instance a whole design, as TOML text. Empty tables are left out.

    The keys outside tables come first, because TOML requires this. A table may contain tables, but these may contain
    only values.
    """
    lines = _lines_of_keys({key: value for key, value in data.items() if not isinstance(value, Mapping)})
    tables = {name: keys for name, keys in data.items() if isinstance(keys, Mapping)}
    for table, keys in tables.items():
        plain_keys = {key: value for key, value in keys.items() if not isinstance(value, Mapping)}
        subtables = {f"{table}.{key}": value for key, value in keys.items() if isinstance(value, Mapping)}
        for name, values in {table: plain_keys, **subtables}.items():
            if values:
                lines += ["", f"[{name}]", *_lines_of_keys(values)]
    return "\n".join(lines) + "\n"


def _lines_of_keys(values: Mapping[str, Any]) -> list[str]:
    """Return the line KEY = VALUE of each key."""
    return [f"{key} = {value_as_toml(value)}" for key, value in values.items()]


def value_as_toml(value: object) -> str:
    """Return a number, a string or a list as TOML. TOML and JSON have the same notation for these values."""
    return json.dumps(value, ensure_ascii=False)
