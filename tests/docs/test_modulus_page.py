"""docs/modulus.md: its files are virtual tests, and its commands give what it shows."""

import io
from pathlib import Path

import numpy as np
import pytest
from virtual_compression import VirtualTest

ROOT = Path(__file__).parents[2]


@pytest.mark.parametrize(("number", "E"), [(1, 0.7), (2, 1.5), (3, 3.0)])
def test_files_of_the_page_are_virtual_tests(number, E):
    """They have five digits; another machine may round the last one the other way."""
    test = VirtualTest(E_MPa=E, noise_percent=0.5, rows=300, seed=number)
    files = (ROOT / "docs" / "examples" / f"fruit-{number}.csv", io.StringIO(test.csv()))
    committed, written = (np.loadtxt(file, delimiter=",", skiprows=1) for file in files)
    np.testing.assert_allclose(committed, written, rtol=0.0, atol=1.5e-5)
