"""Designs and settings that are refused, row by row of design.toml, each in one line that names the field."""

import re
import tomllib
from pathlib import Path

import pytest

from sensor.design.design_file import design_from_mapping
from sensor.design.design_tables import DesignTables, settings_of_texts
from sensor.quantity import InputError

TABLE = tomllib.loads(Path(__file__).with_name("design.toml").read_text(encoding="utf-8"))
BOUND = re.compile(r"(?P<side>at most|less than|greater than) .* = (?P<number>[0-9.e+-]+)( [^ ]+)?")
SPHERE = {"fruit": {"shape": "sphere", "radius_mm": 35.0}}
LONG_SETTINGS = [
    ("tips.side_mm", "{" + ".".join(5000 * ["a"]) + " = 1}"),
    ("targets.NL", 3000 * "[" + 3000 * "]"),
    ("targets.P_max", "1" * 5000),
]


def tables_of(field, value):
    """Return the tables of a design in which a field has a value."""
    table, _, key = field.partition(".")
    return {table: {key: value} if key else value}


def laid_on(tables, changes):
    """Return tables with changes laid on them."""
    both = dict(tables)
    for table, keys in changes.items():
        is_merged = isinstance(keys, dict) and isinstance(both.get(table), dict)
        both[table] = {**both[table], **keys} if is_merged else keys
    return both


def expanded():
    """Yield the field and the tables of each refused design."""
    for group in TABLE["group"]:
        for field, given in group["rows"]:
            changes = [given] if isinstance(given, dict) else [tables_of(field, value) for value in given]
            for each in changes:
                yield pytest.param(laid_on(group["on"], each), field, id=f"{field}-{each}")
    yield pytest.param(tables_of("targets.P_max", 10**400), "targets.P_max", id="targets.P_max-10**400")


def refused_field(tables):
    """Return the field for which a design is refused, or an empty text."""
    try:
        design_from_mapping(tables)
    except InputError as error:
        return error.field
    return ""


@pytest.mark.parametrize(("tables", "field"), [*expanded()])
def test_design_is_refused(tables, field):
    """In one line; a bound that follows from other keys, "at most ... = 12 mm" to six digits, is where it begins."""
    with pytest.raises(InputError) as error:
        design_from_mapping(tables)
    assert error.value.field == field
    assert len(str(error.value).splitlines()) == 1
    if stated := BOUND.fullmatch(error.value.bound):
        number = float(stated["number"])
        taken, beyond = {
            "at most": (number, number * (1.0 + 1e-5)),
            "less than": (number * (1.0 - 1e-5), number),
            "greater than": (number * (1.0 + 1e-5), number),
        }[stated["side"]]
        assert refused_field(laid_on(tables, tables_of(field, taken))) != field
        assert refused_field(laid_on(tables, tables_of(field, beyond))) == field


@pytest.mark.parametrize(("key", "text"), [*TABLE["settings"], *LONG_SETTINGS], ids=lambda text: text[:20])
def test_setting_is_refused(key, text):
    with pytest.raises(InputError) as error:
        DesignTables(tables=SPHERE).design(settings_of_texts({key: text}))
    assert error.value.field == key
    assert len(str(error.value).splitlines()) == 1
