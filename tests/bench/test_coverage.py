"""Ten random contact scenes of the coverage script, judged by the next finer mesh; and a bar of zero is seen."""

import dataclasses
import importlib.util
import sys
from pathlib import Path

import pytest

from pipeline import hard_contact
from solve.split import LEVELS

SCRIPT = Path(__file__).with_name("coverage.py")


@pytest.fixture(scope="module")
def coverage():
    spec = importlib.util.spec_from_file_location("error_bar_coverage", SCRIPT)
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    yield module
    del sys.modules[spec.name]


def test_ten_random_scenes_lie_inside_their_bars(coverage, monkeypatch):
    # Twice the dofs instead of four times, to be quick.
    monkeypatch.setattr(hard_contact, "FINER", (dataclasses.replace(LEVELS[1], step=0.57),))
    for found in coverage.contact_coverage(10, 3, 0.0):
        assert len(found.claims) == 10
        assert found.holds
        zero = dataclasses.replace(found, claims=tuple(dataclasses.replace(one, bar=0.0) for one in found.claims))
        assert not zero.holds


def test_table_has_a_row_for_each_number(coverage):
    claim = coverage.Claim(name="s", value=1.0, bar=1e-3, reference=1.0005, uncertainty=0.0, by="formula")
    lines = list(coverage.table([coverage.Covered("s", (claim, dataclasses.replace(claim, reference=1.004)), ("no",))]))
    assert lines[2] == "| s | 2 | 1 | 50.0 % | 4.00 | 1.1 | 0.1 % | 0.1 % |"
