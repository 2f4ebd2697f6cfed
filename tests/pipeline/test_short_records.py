"""What a run returns is short in print, and a table in a notebook, whatever it holds."""

import dataclasses
import xml.etree.ElementTree as ET

import numpy as np
import pytest
from stand_ins import result_of, stored_report

from sensor.record import Record, short_text

MOST_LETTERS = 2000


def records(value, name="result"):
    """Yield every record below a value with the names that lead to it."""
    if dataclasses.is_dataclass(value):
        yield name, value
        for field in dataclasses.fields(value):
            yield from records(getattr(value, field.name), f"{name}.{field.name}")


def test_everything_in_a_result_is_short_in_print():
    lengths = {name: len(repr(record)) for name, record in records(result_of())}
    assert {name: length for name, length in lengths.items() if length > MOST_LETTERS} == {}
    assert "result.press.curve" in lengths
    report = stored_report(result_of())
    assert len(repr(dataclasses.replace(result_of(), report=report).report)) <= MOST_LETTERS < len(repr(report))


def test_record_is_a_table_of_its_fields_without_markup():
    @dataclasses.dataclass(repr=False)
    class Named(Record):
        name: str

    table = ET.fromstring(Named("<b>&")._repr_html_())
    assert [table.find(place).text for place in ("caption", "tr/th", "tr/td")] == ["Named", "name", "'<b>&'"]


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (np.array([1.0, 2.5]), "[1, 2.5]"),
        (np.array([[1.0, np.nan, 3.0], [4.0, 5.0, -6.5]]), "array of 2 x 3, -6.5 to 5, 1 missing"),
        (np.full((2, 9), np.nan), "array of 2 x 9"),
        (np.zeros((0, 2)), "array of 0 x 2"),
        ((1.0, 2.0), "(1, 2)"),
        (tuple(range(9)), "9 x int"),
        ({"a": 1}, "1 keys"),
        ("x" * 200, "'" + 79 * "x" + "..."),
        (None, "None"),
    ],
)
def test_value_is_told_in_few_letters(value, text):
    assert short_text(value) == text
