"""Designs that are measured, their contact solved once for all tests of the session."""

import pytest
from measured_units import MeasuredDesign


@pytest.fixture(scope="session")
def mango():
    """Return the square of domes, its readings assessed."""
    return MeasuredDesign("mango")


@pytest.fixture(scope="session")
def paper():
    """Return the pair on its flat block."""
    return MeasuredDesign("paper")
