import tomllib

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sensor.design.design_file import (
    design_as_mapping,
    design_as_toml,
    design_from_mapping,
)
from sensor.design.design_tables import DesignTables, settings_of_texts
from sensor.design.fruit import Fruit
from sensor.design.parameters import Design, GivenSprings, Print, Targets
from sensor.design.processes import PROCESSES
from sensor.design.tips import Tips
from sensor.gone import INEFFECTIVE_VALUES

PAPER = """
name = "paper"
[targets]
P_max = 5
NL = 0.05
[fruit]
E_MPa = [0.5, 1, 3.5]
[tips]
spacing_mm = 8
"""


SOFTER, STIFFER = st.floats(1e-3, 1.0), st.floats(1.1, 1e6)
DESIGNS = st.builds(
    Design,
    name=st.from_regex(r"[A-Za-z0-9_-]{0,20}[A-Za-z0-9]", fullmatch=True),
    targets=st.builds(Targets, P_max=st.floats(1.001, 100.0), NL_definition=st.sampled_from(["mid-range", "largest"])),
    springs=st.just(GivenSprings()) | st.builds(GivenSprings, K_l_N_per_m=SOFTER, K_h_N_per_m=STIFFER),
    fruit=st.builds(
        Fruit,
        E_MPa=st.lists(st.floats(1e-6, 1e6), min_size=1, max_size=5).map(tuple),
        bruise_limit_MPa=st.none() | st.floats(1e-3, 1e3),
    ),
    tips=st.builds(Tips, offset_mm=st.floats(-5.0, 5.0)),
    print=st.builds(Print, process=st.sampled_from(list(PROCESSES)), max_length_mm=st.floats(1e-3, 1e3)),
)


@settings(max_examples=15)
@given(design=DESIGNS)
def test_design_survives_toml_and_every_key_can_be_set_from_the_command_line(design):
    text = design_as_toml(design)
    read = design_from_mapping(tomllib.loads(text))
    assert read == design
    assert design_as_toml(read) == text
    flags = {"name": design.name}
    for table, values in design_as_mapping(design).items():
        if table != "name":
            flags |= {f"{table}.{key}": str(value) for key, value in values.items()}
    assert DesignTables(tables={}).design(settings_of_texts(flags)) == design


@pytest.mark.parametrize(
    ("setting", "text", "value"),
    [
        ("targets.NL", "0.1", 0.1),
        ("targets.P_max", "4", 4.0),
        ("fruit.E_MPa", "[1, 2]", (1.0, 2.0)),
        ("print.process", "fdm-pla", "fdm-pla"),
        ("print.process", '"fdm-pla"', "fdm-pla"),
        ("targets.NL_definition", "largest", "largest"),
    ],
)
def test_setting_lies_on_top_of_the_file(setting, text, value):
    data = tomllib.loads(PAPER)
    table, _, key = setting.partition(".")
    design = DesignTables(tables=data).design(settings_of_texts({setting: text}))
    assert getattr(getattr(design, table), key) == value
    assert data == tomllib.loads(PAPER), "the tables that were handed in stay as they were"
    assert (design.tips.spacing_mm, design.fruit.E_MPa[-1]) == (8.0, 3.5 if table != "fruit" else 2.0)


def test_empty_setting_unsets_a_key_or_a_table():
    """A radius of no sphere must go; a key with a default has that again; a table that is optional is dropped."""
    round_fruit = {"fruit": {"shape": "sphere", "radius_mm": 35.0, "height_mm": 10.0}, "reading": {"tilt_deg": 8.0}}
    unset = dict.fromkeys(["fruit.radius_mm", "fruit.height_mm", "reading.tilt_deg"])
    flat = DesignTables(tables=round_fruit).design({"fruit.shape": "block", **unset})
    assert (flat.fruit.radius_mm, flat.fruit.height_mm) == (None, 12.0)
    assert flat.reading is not None
    assert flat.reading.tilt_deg == 4.0
    assert DesignTables(tables={"reading": {"tilt_deg": 8.0}}).design({"reading": None}).reading is None


def test_keys_of_tips_are_written_in_the_order_whose_digest_units_hold():
    """unit.toml holds the sha256 of this text: the order of the keys must not follow that of the classes."""
    cone = Tips(shape="cone", half_angle_deg=70.0, socket="pin")
    written = tomllib.loads(design_as_toml(Design(tips=cone)))["tips"]
    first = ["layout", "shape", "side_mm", "fillet_mm", "spacing_mm", "offset_mm", "gap_mm", "socket"]
    assert list(written) == [*first, "half_angle_deg"]


def test_plan_of_a_whole_fruit_is_written_only_into_the_text_whose_digest_units_hold():
    """In a file it would cut a piece out of the fruit of another radius."""
    design = Design(fruit=Fruit(shape="sphere", radius_mm=30.0, height_mm=40.0))
    assert not {"length_mm", "width_mm"} & design_as_mapping(design)["fruit"].keys()
    whole = DesignTables.from_design(design).design({"fruit.radius_mm": 36.0}).fruit
    assert (whole.is_whole, whole.length_mm, whole.width_mm) == (True, 72.0, 72.0)
    assert list(design_as_mapping(design, derived=True)["fruit"])[:3] == ["shape", "length_mm", "width_mm"]


@pytest.mark.parametrize(("name", "value"), INEFFECTIVE_VALUES.items())
def test_key_that_asked_for_nothing_is_read_and_not_written_again(name, value):
    table, _, key = name.partition(".")
    design = design_from_mapping({table: {key: value}})
    assert design == design_from_mapping({table: {}})
    assert key not in design_as_mapping(design)[table]
