"""What is written in a table is read, in any named unit; what is none names file, line, column, value and bound."""

import os

import pytest
from hypothesis import given
from hypothesis import strategies as st
from refusal import refusal

from pipeline.tables.headers import ColumnFlags
from pipeline.tables.measured_table import numbers_of
from pipeline.tables.number_formats import is_number
from pipeline.tables.units import FORCE, LENGTH, Quantity
from sensor.input_file import MOST_BYTES

QUANTITIES = {
    "tip": Quantity(units={}),
    "force": Quantity(units=FORCE, most=1e3, words=("weight",)),
    "travel": Quantity(units=LENGTH, default="mm"),
}
PLAIN = "tip,force_N,travel_mm\nlow,1.5,0.25\n"


def read_table(path):
    return numbers_of(path, QUANTITIES, [("tip", "force")], "tip,force_N,travel_mm")


@pytest.fixture
def source(tmp_path):
    """Return a function that writes a table and returns its path."""

    def written(content):
        path = tmp_path / "table.csv"
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return path

    return written


@pytest.mark.parametrize(
    "content",
    [
        PLAIN,
        b"\xef\xbb\xbf" + PLAIN.encode(),
        PLAIN.encode("utf-16"),
        PLAIN.replace("\n", "\r\n"),
        PLAIN.replace("\n", "\n\n"),
        "tip,Force (N),travel [mm]\nlow,1.5,0.25\n",
        "tip;force_N;travel\nlow;1,5;0,25\n",
        'tip,force_N,travel\nlow,"1,5","0,25"\n',
        "tip\tforce_mN\ttravel_um\nlow\t1500\t250\n",
        "travel_µm,tip,force N\n250,low,1.5\n".encode("cp1252"),
        "travel_in,tip,force_kgf\n0.00984251968503937,low,0.15295743194\n",
        "tip,weight_g,travel_mm\nlow,152.95743194,.25\n",
        "tip,force_ozf,travel_mm\nlow,5.3954145,.25\n",
        "tip,weight_oz,travel_mm\nlow,5.3954145,.25\n",  # a pound-force is 4.4482216152605 N
    ],
)
def test_every_writing_gives_the_same_numbers(content, source):
    table = read_table(source(content))
    assert table.texts == {"tip": ("low",)}
    assert table.numbers == {"force": pytest.approx([1.5]), "travel": pytest.approx([0.25])}


def test_last_digit_is_that_which_is_written(source):
    for cell, step in (("0.250", 1e-3), ("25e-2", 1e-2), ("7", 1.0), ("0,25", 1e-2)):
        table = read_table(source(f"tip;force_N;travel_mm\nlow;1;{cell}\n"))
        assert table.last_digits["travel"] == pytest.approx([step])


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_numbers_are_those_of_python(value):
    assert is_number(repr(value))
    assert is_number(repr(value).replace(".", ","))


def test_largest_number_is_allowed(source):
    table = read_table(source("tip,force_kN,travel_mm\nlow,1,0\n"))
    assert table.numbers["force"].tolist() == [1e3]


def test_source_has_to_be_a_regular_file_of_some_size(tmp_path):
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    for path in (tmp_path / "none.csv", tmp_path, pipe):
        assert refusal(read_table, path).field == "FILE"
    large = tmp_path / "large.csv"
    with large.open("wb") as file:
        file.truncate(MOST_BYTES + 1)
    caught = refusal(read_table, large)
    assert (caught.field, caught.value) == ("FILE", str(large))


def test_flags_name_headers_and_units():
    flagged = ColumnFlags("force=Last, z,travel=Pfad [mm]", "force=KN").applied(QUANTITIES)
    assert [flagged[name].selected_column for name in QUANTITIES] == ["", "Last, z", "Pfad [mm]"]
    assert [flagged[name].flag_unit for name in QUANTITIES] == ["", "kN", ""]
    for columns, units, field in (
        ("Last", None, "--columns"),
        ("mass=M", None, "--columns"),
        ("force=", None, "--columns"),
        ("force=1,force=2", None, "--columns"),
        (None, "force=t", "--units"),
    ):
        assert refusal(ColumnFlags(columns, units).applied, QUANTITIES).field == field
