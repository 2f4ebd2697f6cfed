"""One clean curve in every shape that machines export reads as the same curve; what was understood is one line."""

import numpy as np
import pytest
from export_shapes import EXTRAS, FORCE, SHAPES, TIME, TRAVEL

from instrument.compress.specimens import QUANTITIES, read_specimens
from pipeline.tables.headers import ColumnFlags


@pytest.mark.parametrize("name", SHAPES)
def test_shape_reads_as_the_clean_curve(name, tmp_path):
    """Forces are written to 1e-4 N, in kN and tons of it to nine digits; thousands in 0.1 mN."""
    shape = SHAPES[name]
    path = tmp_path / f"shape.{shape.suffix}"
    path.write_bytes(shape.content)
    (specimen,) = read_specimens(path, ColumnFlags(shape.columns, shape.units).applied(QUANTITIES))
    np.testing.assert_allclose(specimen.travel, TRAVEL, atol=1e-6)
    np.testing.assert_allclose(specimen.force, FORCE, atol=2e-4)
    if specimen.time is not None:
        np.testing.assert_allclose(np.diff(specimen.time), np.diff(TIME), atol=1e-4)
    assert len(specimen.summary.splitlines()) == 1
    assert "force = " in specimen.summary
    assert "26 rows" in specimen.summary


@pytest.mark.parametrize("label", EXTRAS)
def test_column_that_is_passed_over_is_named(label, tmp_path):
    path = tmp_path / "shape.csv"
    path.write_bytes(SHAPES[f"beside {label}"].content)
    (specimen,) = read_specimens(path)
    assert f"passed over {label!r}" in specimen.summary
