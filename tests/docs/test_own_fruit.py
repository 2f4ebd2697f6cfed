"""The six fruits of docs/your-own-fruit.md: their limits are the stated law and the preset's, never wider."""

from pathlib import Path

import pytest

from pipeline.options import load_design
from pipeline.study.suggest.fruit_range import bruise_limit
from pipeline.verdicts.hints import least_travel

ROOT = Path(__file__).parents[2]
FRUITS = ("kiwi", "apple", "peach", "avocado", "tomato")
MANGO = load_design("mango")


@pytest.mark.parametrize("name", FRUITS)
def test_limits_are_no_wider_than_those_of_the_law_and_the_preset(name):
    design = load_design(ROOT / "docs" / "examples" / f"{name}.toml")
    assert design.name == name
    for E, limit in zip(design.fruit.E_MPa, design.fruit.bruise_limits_MPa, strict=True):
        assert limit <= bruise_limit(E)
    assert design.reading is not None
    assert MANGO.reading is not None
    for key in ("bias_limit", "uncertainty_limit"):
        assert getattr(design.reading, key) <= getattr(MANGO.reading, key)
    for key in ("tilt_deg", "radius_spread", "noise_percent", "stiffness_percent", "gain_percent"):
        assert getattr(design.reading, key) >= getattr(MANGO.reading, key)
    assert design.press.travel_mm >= least_travel(design)
