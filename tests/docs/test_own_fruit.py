"""The presets of fruits in docs/presets.md: their limits are the stated law and the mango's, never wider."""

import pytest

from pipeline.find.fruit_design import PRESETS
from pipeline.find.fruit_range import bruise_limit
from pipeline.options import load_design
from pipeline.verdicts.hints import least_travel

FRUITS = tuple(name for name in PRESETS if name != "mango")
MANGO = load_design("mango")


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
