"""What a design file or a setting may not say: each is one line that names the field."""

import pytest

from sensor.design.design_file import design_from_mapping
from sensor.design.design_tables import DesignTables, settings_of_texts
from sensor.design.parameters import TABLES
from sensor.gone import REMOVED
from sensor.quantity import InputError


@pytest.mark.parametrize("name", [name for name in REMOVED if name.partition(".")[0] in TABLES])
def test_key_that_is_gone_is_refused_with_what_to_use(name):
    """In a table, in a setting, and where a setting unsets it: it is not told as a key that is spelt wrong."""
    table, _, key = name.partition(".")
    for tables, settings in (({table: {key: "something"}}, {}), ({}, {name: "2"}), ({}, {name: ""})):
        with pytest.raises(InputError) as error:
            DesignTables(tables=tables).design(settings_of_texts(settings))
        assert error.value.field == name
        assert str(error.value).endswith(f" {REMOVED[name]}")


@pytest.mark.parametrize(
    ("tables", "suggestion"),
    [
        ({"target": {}}, "targets"),
        ({"tips": {"spacing": 8}}, "spacing_mm"),
        ({"fruit": {"HIGHT_MM": 8}}, "height_mm"),
        ({"print": {"process": "PETG"}}, "fdm-petg"),
        ({"tips": {"shape": "Cone-"}}, "cone"),
    ],
)
def test_the_nearest_name_is_suggested(tables, suggestion):
    with pytest.raises(InputError) as error:
        design_from_mapping(tables)
    assert str(error.value).endswith(f"Did you mean {suggestion}?")


def test_tips_may_reach_the_edge_of_the_fruit():
    assert design_from_mapping({"tips": {"spacing_mm": 19.0}}).tips.spacing_mm == 19.0


def test_setting_below_a_key_that_is_no_table_is_refused():
    with pytest.raises(InputError) as error:
        DesignTables(tables={"targets": 5}).with_settings({"targets.NL": 0.1})
    assert error.value.field == "targets"


def test_table_that_is_no_table_is_refused_although_a_setting_removes_another():
    with pytest.raises(InputError) as error:
        DesignTables(tables={"print": 5, "printer": {}}).design({"printer": None})
    assert error.value.field == "print"


@pytest.mark.parametrize(("thickness", "hint"), [(0.9, "choose 0.8 or 1.2 mm"), (0.1, "choose 0.4 or 0.8 mm")])
def test_leaf_of_no_whole_number_of_lines_is_told_the_nearest_ones(thickness, hint):
    with pytest.raises(InputError) as error:
        design_from_mapping({"print": {"leaf_thickness_high_mm": thickness}})
    assert error.value.bound.startswith("a whole number of lines of 0.4 mm")
    assert hint in str(error.value).lower()
