"""What a reading says: its keys with their units, and one part of the line for each thing that is known."""

import pytest

from instrument.press.fruit_reading import LINE, FruitReading
from pipeline.storage.record_data import as_data, as_line
from sensor.quantity import COVERAGE, Estimate

READ = {"E": 1.5, "reduced": 1.65, "u": 0.5}
ALWAYS = {
    *("E_MPa", "E_over_1_minus_nu2_MPa", "u_percent", "tilt_deg", "tilt_direction_deg", "flags", "class"),
}


@pytest.mark.parametrize(
    ("fields", "data"),
    [
        ({}, {}),
        (READ, {"E_MPa": 1.5, "E_over_1_minus_nu2_MPa": 1.65, "u_percent": 50.0}),
        ({"t": 0.5}, {"t_s": 0.5, "samples": None, "u_noise_percent": None, "u_left_percent": None}),
        (
            {**READ, "t": 0.5, "samples": 9, "noise": 0.3},  # 0.5^2 = 0.3^2 + 0.4^2
            {"t_s": 0.5, "samples": 9, "u_noise_percent": 30.0, "u_left_percent": pytest.approx(40.0)},
        ),
        ({"bend": 0.02}, {"u_bend_percent": 2.0}),
        ({"offset": -0.1, "offset_u": 0.02}, {"offset_mm": -0.1, "offset_u_mm": 0.02}),
        ({"lines_left_out": (3, 4)}, {"lines_left_out": [3, 4]}),
        ({"firmness": Estimate(20.0, 1.0, "N")}, {"firmness_N": 20.0, "firmness_u_percent": 5.0 * COVERAGE}),
        ({"others": {"force_ratio": 2.0}}, {"E_force_ratio_MPa": 2.0}),
        ({"relaxation": 0.7}, {"relaxation_ratio": 0.7}),
        ({"zero_left": 0.01, "zero_left_of_touch": 0.2}, {"zero_left_N": 0.01, "zero_left_of_touch": 0.2}),
        ({"ripeness": "ripe", "flags": ("spike",)}, {"class": "ripe", "flags": ["spike"]}),
    ],
)
def test_keys_are_there_where_their_numbers_are(fields, data):
    told = as_data(FruitReading(**fields))
    assert told.keys() == ALWAYS | data.keys()
    assert {key: told[key] for key in data} == data


@pytest.mark.parametrize(("of_touch", "parts"), [(0.5, 2), (0.51, 3)])
def test_zero_that_could_pass_for_a_touch_is_in_the_line(of_touch, parts):
    read = FruitReading(**READ, zero_left=0.01, zero_left_of_touch=of_touch)
    assert len(as_line(read, LINE).split("  ")) == parts


def test_numbers_of_the_line_are_in_the_units_that_it_names():
    read = FruitReading(**READ, t=0.5, samples=9, noise=0.3, bend=0.02, firmness=Estimate(20.0, 1.0, "N"))
    t, reduced, E, noise, bend, firmness = as_line(read, LINE).split("  ")
    assert [t, reduced] == ["t 0.500 s", "E/(1 - nu^2) 1.65 MPa"]
    assert ("± 50 %" in E, "30 %" in noise, "9 samples" in noise, " 2 %" in bend) == (True, True, True, True)
    assert f"± {5.0 * COVERAGE:g} %" in firmness
