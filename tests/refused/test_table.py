"""Tables that are refused, row by row of table.toml, each in one line that names file, line and column."""

import tomllib
from pathlib import Path

import pytest
from measured_units import MeasuredDesign

from instrument.calibrate.calibration import calibrate_unit, read_print_table
from instrument.calibrate.fruit_presses import read_fruit_table
from instrument.compress.specimens import QUANTITIES, read_specimens
from instrument.press.signals import Signal
from pipeline.tables.headers import ColumnFlags
from pipeline.tables.measured_table import numbers_of
from pipeline.tables.rows import Rows
from pipeline.tables.units import FORCE, LENGTH, Quantity
from sensor.quantity import InputError

GROUPS = tomllib.loads(Path(__file__).with_name("table.toml").read_text(encoding="utf-8"))["group"]
ROWS = [(group, *row) for group in GROUPS for row in group["rows"]]
TABLE = {
    "tip": Quantity(units={}),
    "force": Quantity(units=FORCE, most=1e3, words=("weight",)),
    "travel": Quantity(units=LENGTH, default="mm"),
}
LONG_LINE = "low," + "1" * 200_000 + ",2\n"
FILE = "table.csv"


@pytest.fixture(scope="module")
def paper():
    """Return the report of the pair."""
    return MeasuredDesign("paper", assessed=False).report


@pytest.fixture
def read(request, tmp_path, monkeypatch):
    """Return a function that reads a text with a reader, by its name in table.toml."""
    monkeypatch.chdir(tmp_path)

    def table(_):
        return numbers_of(Path(FILE), TABLE, [("tip", "force")], "tip,force_N,travel_mm")

    def compression(columns):
        return read_specimens(Path(FILE), ColumnFlags(columns, None).applied(QUANTITIES))

    def press(_):
        return list(Signal(Rows(Path(FILE).read_text(encoding="utf-8").splitlines(), FILE), 2))

    def weights(_):
        report = request.getfixturevalue("paper")
        return calibrate_unit(report, read_print_table(Path(FILE), report))

    def fruit(_):
        return read_fruit_table(Path(FILE), 4)

    readers = {reader.__name__: reader for reader in (table, compression, press, weights, fruit)}

    def read_text(reader, text, columns=None):
        encoding = "latin-1" if max(text, default="") < "\u0100" else "utf-8"
        Path(FILE).write_bytes(text.encode(encoding))
        return readers[reader](columns)

    return read_text


def refusal_of(read, *words):
    """Return the error that refuses a text, which is one line."""
    with pytest.raises(InputError) as error:
        read(*words)
    assert "\n" not in str(error.value)
    return error.value


@pytest.mark.parametrize("row", ROWS, ids=[f"{group['reader']}-{text[:40]}" for group, text, *_ in ROWS])
def test_table_is_refused(row, read):
    group, text, place, *others = row
    value, columns = [*others, None, None][:2]
    error = refusal_of(read, group["reader"], group.get("above", "") + text + group.get("below", ""), columns)
    assert error.field == FILE + (place if place.startswith(":") else f", {place}" if place else "")
    if others:
        assert error.value == (pytest.approx(value, rel=1e-4) if isinstance(value, float) else value)


def test_line_without_end_is_cut_in_its_error(read):
    error = refusal_of(read, "table", f"tip,force_N,travel_mm\nlow,1.5,0.25\n{LONG_LINE}")
    assert (error.field, error.value) == (f"{FILE}, line 3", LONG_LINE[:40])
