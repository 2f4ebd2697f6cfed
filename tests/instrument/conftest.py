"""Designs that are measured, their contact solved once for all tests of the session."""

import pytest
from measured_units import MeasuredDesign
from squares import BALL

from instrument.calibrate.calibration import calibrate_unit, read_print_table
from instrument.calibrate.hard_plate import read_plate_table


@pytest.fixture(autouse=True, scope="session")
def _work_here(kernel_here, curves_once):
    """Make solids in this process, and solve a force curve once."""


@pytest.fixture(scope="session")
def mango():
    """Return the square of domes, its readings assessed."""
    return MeasuredDesign("mango")


@pytest.fixture(scope="session")
def ball():
    """Return the square of domes that reference presses were found for, with ranges of no ellipsoid."""
    return MeasuredDesign(BALL)


@pytest.fixture(scope="session")
def paper():
    """Return the pair on its flat block."""
    return MeasuredDesign("paper")


@pytest.fixture
def calibrate(tmp_path):
    """Return a function that writes a table and calibrates a unit of a report by it."""

    def calibration(report, text, plate=None, counts_as=None):
        path = tmp_path / "measured.csv"
        path.write_text(text, encoding="utf-8")
        table = read_print_table(path, report, counts_as=counts_as)
        if plate is None:
            return calibrate_unit(report, table)
        path.write_text(plate, encoding="utf-8")
        return calibrate_unit(report, table, plate=read_plate_table(path, report, counts_as=counts_as))

    return calibration
