"""Every fruit of the table is one that a sensor can be asked for, and each of its ranges has a source."""

import pytest

from pipeline.find.changes import change_design
from pipeline.find.fruit_design import most_similar_preset, scaled_changes
from pipeline.find.fruit_range import fruit_range
from pipeline.options import load_design
from sensor.design.fruits import FRUITS, NamedFruit
from sensor.quantity import InputError

TABLE = {
    "radius_mm": [20.0, 30.0],
    "radius_across_mm": [30.0, 40.0],
    "thickness_mm": [10.0, 20.0],
    "E_MPa": [0.5, 2.0],
    "bruise_limit_MPa": [0.05, 0.2],
    "relaxes_to": 0.5,
}
TABLE["sources"] = dict.fromkeys(TABLE, "measured here")


@pytest.mark.parametrize("name", FRUITS)
def test_a_fruit_of_the_table_is_a_range_from_which_a_design_is_scaled(name):
    fruit, asked = FRUITS[name], fruit_range(name)
    assert (asked.radii_mm, asked.thickness_mm) == ((fruit.radius_mm, fruit.radius_across_mm), fruit.thickness_mm)
    assert (asked.E_min_MPa, asked.E_max_MPa) == fruit.E_MPa
    assert fruit.radius_mm[0] <= fruit.radius_across_mm[0]
    preset = load_design(most_similar_preset(asked))
    design = change_design(preset, scaled_changes(asked, preset))
    assert design.fruit.name == name
    limits = design.fruit.bruise_limits_MPa
    assert (limits[0], limits[-1]) == fruit.bruise_limit_MPa


def test_pressure_that_flesh_stands_is_a_power_of_its_modulus():
    """Between the ends of the table in the same ratio: 0.05 to 0.2 MPa over a factor of 4 in E is 0.1 E."""
    guava = NamedFruit.from_table("guava", TABLE)
    assert [guava.bruise_limit(E) for E in (0.5, 1.0, 2.0)] == pytest.approx([0.05, 0.1, 0.2])


@pytest.mark.parametrize(
    ("key", "value", "field"),
    [
        ("radius_mm", [30.0, 20.0], "radius_mm"),
        ("thickness_mm", [10.0], "thickness_mm"),
        ("E_MPa", [0.0, 2.0], "E_MPa"),
        ("bruise_limit_MPa", [0.2, 0.05], "bruise_limit_MPa"),
        ("relaxes_to", 1.0, "relaxes_to"),
        ("E_MPa", [0.5, 1.0, 2.0], "E_MPa"),
        ("sources", {"radius_mm": "measured here"}, "E_MPa"),
        ("mass_g", 3.0, "mass_g"),
    ],
)
def test_a_wrong_fruit_is_refused_by_its_key(key, value, field):
    with pytest.raises(InputError) as refused:
        NamedFruit.from_table("guava", {**TABLE, key: value})
    assert refused.value.field.startswith(f"fruit guava.{field}")
