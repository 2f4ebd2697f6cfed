"""The presets of fruits in docs/presets.md: their limits are the stated law and the mango's, never wider."""

import re
from pathlib import Path

import pytest

from pipeline.find.fruit_design import PRESETS
from pipeline.find.fruit_range import bruise_limit
from pipeline.options import load_design
from pipeline.verdicts.hints import least_travel

ROOT = Path(__file__).parents[2]
FRUITS = tuple(name for name in PRESETS if name != "mango")
RANGES = ("radius_mm", "radius_across_mm", "thickness_mm")
MANGO = load_design("mango")


def reading_of(name):
    reading = load_design(name).reading
    assert reading is not None
    return reading


@pytest.mark.parametrize("name", FRUITS)
def test_limits_are_no_wider_than_those_of_the_law_and_the_mango(name):
    design = load_design(name)
    assert design.name == name
    for E, limit in zip(design.fruit.E_MPa, design.fruit.bruise_limits_MPa, strict=True):
        assert limit <= bruise_limit(E)
    assert design.reading is not None
    assert MANGO.reading is not None
    assert design.reading.bias_limit <= MANGO.reading.bias_limit
    limits = zip(design.reading.uncertainty_limit, MANGO.reading.uncertainty_limit, strict=True)
    assert all(limit <= of_mango for limit, of_mango in limits)
    assert (design.reading.stiffness_percent, design.reading.gain_percent, design.bench) == (None, None, None)
    for key in ("tilt_deg", "tilt_change_deg", "off_centre_mm", "noise_percent"):
        assert getattr(design.reading, key) >= getattr(MANGO.reading, key)
    assert design.press.travel_mm >= least_travel(design)


@pytest.mark.parametrize("name", PRESETS)
def test_page_gives_the_ranges_of_each(name):
    """The row of radii, flesh and moduli in docs/presets.md is what the file says."""
    page = (ROOT / "docs" / "presets.md").read_text(encoding="utf-8")
    row = next(line for line in page.splitlines() if line.startswith(f"| `{name}`") and line.count(" to ") >= 4)
    design, reading = load_design(name), reading_of(name)
    spans = [*(getattr(reading, key) for key in RANGES), (min(design.fruit.E_MPa), design.fruit.E_max_MPa)]
    told = [tuple(map(float, span)) for span in re.findall(r"([\d.]+) to ([\d.]+)", row)]
    assert told == spans
    springs = (design.springs.K_l_N_per_m, design.springs.K_h_N_per_m)
    shape = (design.tips.dome_radius_mm, design.tips.spacing_mm, design.press.travel_mm)
    rest = [tuple(map(float, re.findall(r"[\d.]+", cell))) for cell in row.split("|")[5:7]]
    assert rest == [springs, shape]
