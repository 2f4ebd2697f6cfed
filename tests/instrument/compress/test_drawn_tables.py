"""Tables drawn at random: each is read as its curve, or refused; none is read with a wrong unit."""

from collections import Counter

import numpy as np
import pytest
from drawn_tables import DrawnTable, drawn_table

from instrument.compress.phases import split_phases
from instrument.compress.specimens import QUANTITIES, read_specimens
from pipeline.tables.headers import ColumnFlags
from sensor.quantity import InputError

LEAST_READ = 0.8  # of the tables that say each unit once, in a usual place; the others have names that are not known


def outcome(table: DrawnTable, path) -> str:
    """Return whether a table is read; what is read is its curve, within the digits that are written."""
    path.write_bytes(table.text.encode(table.encoding))
    try:
        specimens = read_specimens(path, ColumnFlags(table.columns, table.units).applied(QUANTITIES))
        for specimen in specimens:
            split_phases(specimen)
    except InputError:
        return "refused"
    (specimen,) = specimens
    np.testing.assert_allclose(specimen.force, table.force, atol=table.digits[0], rtol=1e-9)
    np.testing.assert_allclose(specimen.travel, table.travel, atol=table.digits[1], rtol=1e-9)
    return "read"


@pytest.mark.parametrize("first", [0, pytest.param(1000, marks=pytest.mark.study)])
def test_no_drawn_table_is_read_with_a_wrong_unit(first, tmp_path):
    tables = {seed: drawn_table(seed) for seed in range(first, first + (250 if first == 0 else 5000))}
    found = {seed: outcome(table, tmp_path / "drawn.csv") for seed, table in tables.items()}
    counted = Counter((table.must, found[seed]) for seed, table in tables.items())
    assert counted["refused", "read"] == 0
    assert counted["read", "read"] > LEAST_READ * (counted["read", "read"] + counted["read", "refused"])
    assert min(counted["read", "read"], counted["refused", "refused"]) > 0.1 * len(tables)
