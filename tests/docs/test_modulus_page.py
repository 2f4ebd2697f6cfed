"""docs/modulus.md: its files are virtual tests, and its commands give what it shows."""

import io
import re
from pathlib import Path

import numpy as np
import pytest
from virtual_compression import VirtualTest

from twintip.cli import main

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "modulus.md").read_text(encoding="utf-8")


@pytest.mark.parametrize(("number", "E"), [(1, 0.7), (2, 1.5), (3, 3.0)])
def test_files_of_the_page_are_virtual_tests(number, E):
    """They have five digits; another machine may round the last one the other way."""
    test = VirtualTest(E_MPa=E, noise_percent=0.5, rows=300, seed=number)
    files = (ROOT / "docs" / "examples" / f"fruit-{number}.csv", io.StringIO(test.csv()))
    committed, written = (np.loadtxt(file, delimiter=",", skiprows=1) for file in files)
    np.testing.assert_allclose(committed, written, rtol=0.0, atol=1.5e-5)


@pytest.mark.slow
def test_range_on_the_page_is_what_the_command_prints(monkeypatch, capsys):
    monkeypatch.chdir(ROOT)
    command = next(line for line in PAGE.splitlines() if line.startswith("    pipeline modulus"))
    assert main(command.split()[1:]) == 0
    shown = re.findall(r"^    (\[fruit\]|E_\w+ = .+)$", PAGE, flags=re.MULTILINE)
    assert len(shown) == 3
    assert set(shown) <= set(capsys.readouterr().out.splitlines())
