"""The table of layouts: its page holds what the script finds, and a read-out without the domes' own part misses."""

import dataclasses
import math

import pytest
from bench import layouts

SQUARE = next(row for row in layouts.ROWS if row.name == "square, domes r 1, side 4")
PRINTED = 0.051  # [%], half of the last digit that the page shows


@pytest.fixture(scope="module")
def known():
    return layouts.compliance(layouts.HALF_SPACE, SQUARE.tips, half_space=True)


def test_page_holds_what_the_script_finds(known):
    lines = layouts.PAGE.read_text(encoding="utf-8").splitlines()
    cells = next(line for line in lines if line.startswith(f"| {SQUARE.name} | contrast | half-space |")).split("|")[
        4:-1
    ]
    for tilt, cell in zip(layouts.TILTS, cells, strict=True):
        found = layouts.largest_error(SQUARE, layouts.HALF_SPACE, known, tilt)
        assert float(cell.split()[0]) == pytest.approx(found, abs=PRINTED)


def test_read_out_without_hertz_misses(known, monkeypatch):
    law = layouts.contrast_law
    monkeypatch.setattr(layouts, "contrast_law", lambda *given: dataclasses.replace(law(*given), hertz=0.0))
    found = layouts.largest_error(SQUARE, layouts.HALF_SPACE, known, 2.0)
    assert found == layouts.LIFTS or found > 10.0


def test_reading_of_a_tip_that_is_off_is_no_number():
    assert layouts.shown(layouts.LIFTS) == "lifts"
    assert layouts.shown(math.inf) == "none"
