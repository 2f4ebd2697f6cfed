"""What a design file or a setting may not say: each is one line that names the field."""

import pytest

from sensor.design.design_file import design_from_mapping
from sensor.design.design_tables import DesignTables, settings_of_texts
from sensor.design.parameters import TABLES
from sensor.gone import GONE
from sensor.quantity import InputError

SPHERE = {"shape": "sphere", "radius_mm": 35.0}
SPRINGS = {"K_l_N_per_m": 1200.0, "K_h_N_per_m": 20000.0}
SQUARE = {"layout": "square", "spacing_mm": 6.0}
ELLIPSOID = {"shape": "ellipsoid", "radius_mm": 35.0, "radius_across_mm": 30.0}
PLAN = {"length_mm": 24.0, "width_mm": 24.0, "thickness_mm": 12.0}
LINE = {"layout": "line", "order": "LHL"}
DOMES = {**SQUARE, "shape": "dome", "dome_radius_mm": 10.0, "side_mm": 5.0}
BENCH = ("balance_g", "balance_max_g", "dial_mm")
RADII = {"radius_mm": [42.0, 53.0], "radius_across_mm": [86.0, 144.0]}


def read_on(reading, fruit=None, tips=DOMES):
    """Return the tables of a square that is read on an ellipsoid."""
    fruit = {**ELLIPSOID, **PLAN} if fruit is None else fruit
    return {"reading": reading, "fruit": fruit, "tips": tips, "springs": SPRINGS}


@pytest.mark.parametrize(
    ("tables", "field"),
    [
        ({"target": {}}, "target"),
        ({"nane": "x"}, "nane"),
        ({"targets": {"Pmax": 5}}, "targets.Pmax"),
        ({"fruit": {"a\nb": 8}}, "fruit.a\nb"),
        ({"targets": 5}, "targets"),
        *(({"name": name}, "name") for name in (5, "", "a/b", "x" * 65, "mang\u00f3", "a\nb")),
        *(({"targets": {"NL": value}}, "targets.NL") for value in (0.0, -0.1, 0.5, 5, "five", [0.05])),
        *(({"targets": {"P_max": value}}, "targets.P_max") for value in (1.0, 1e9, 10**400)),
        ({"fruit": {"poisson": 0.5}}, "fruit.poisson"),
        ({"fruit": {"E_MPa": []}}, "fruit.E_MPa"),
        ({"fruit": {"E_MPa": [1.0, 0.0]}}, "fruit.E_MPa"),
        ({"fruit": {"E_MPa": [1.0, 2.0], "bruise_limit_MPa": [0.1]}}, "fruit.bruise_limit_MPa"),
        ({"fruit": {"shape": "sphere"}}, "fruit.radius_mm"),
        ({"fruit": {"shape": "ellipsoid", "radius_mm": 35.0}}, "fruit.radius_across_mm"),
        *(({"fruit": {key: 10.0}}, f"fruit.{key}") for key in ("radius_mm", "radius_across_mm", "thickness_mm")),
        ({"fruit": {**SPHERE, "radius_across_mm": 35.0}}, "fruit.radius_across_mm"),
        *(({"fruit": {**shape, "azimuth_deg": 30.0}}, "fruit.azimuth_deg") for shape in ({}, SPHERE, ELLIPSOID)),
        ({"fruit": {**ELLIPSOID, **PLAN, "azimuth_deg": 181.0}}, "fruit.azimuth_deg"),
        *(({"fruit": {**SPHERE, key: 71.0}}, f"fruit.{key}") for key in ("thickness_mm", "height_mm")),
        # the corner of the piece lies sqrt(2) 25 = 35.4 mm from the axis, beyond the fruit
        ({"fruit": {**SPHERE, "length_mm": 50.0, "width_mm": 50.0}}, "fruit.length_mm"),
        # it lies 2.98 mm below the apex, under the base
        ({"fruit": {**SPHERE, "length_mm": 20.0, "width_mm": 20.0, "thickness_mm": 2.9}}, "fruit.length_mm"),
        ({"fruit": {**SPHERE, "thickness_mm": 4.0}, "press": {"travel_mm": 5.0}}, "press.travel_mm"),
        ({"press": {"travel_mm": 12.0}}, "press.travel_mm"),
        ({"press": {"roll_deg": 31.0}}, "press.roll_deg"),
        ({"print": {"process": "fdm"}}, "print.process"),
        *(
            ({"print": {"leaf_thickness_low_mm": bad}}, "print.leaf_thickness_low_mm")
            for bad in (0.0, -0.8, "0.8", 0.2, 0.9, 13.2)  # lines of 0.4 mm; leaves 14 mm apart with fillets of 0.5 mm
        ),
        ({"print": {"process": "sla-resin", "leaf_thickness_high_mm": 0.05}}, "print.leaf_thickness_high_mm"),
        ({"print": {"process": "sla-resin", "leaf_thickness_high_mm": 13.0}}, "print.leaf_thickness_high_mm"),
        ({"springs": {"K_l_N_per_m": 1.0}}, "springs.K_h_N_per_m"),
        ({"springs": {"K_h_N_per_m": 1.0}}, "springs.K_l_N_per_m"),
        ({"springs": {"K_l_N_per_m": 17300.0, "K_h_N_per_m": 753.0}}, "springs.K_l_N_per_m"),
        ({"tips": {"spacing_mm": 1.0}}, "tips.spacing_mm"),
        ({"tips": {"spacing_mm": 19.1}}, "tips.spacing_mm"),
        *(({"tips": {"offset_mm": offset}}, "tips.spacing_mm") for offset in (5.6, -5.6)),
        ({"tips": {"side_mm": 2.0}, "fruit": {"width_mm": 1.5}}, "tips.side_mm"),
        ({"tips": {"shape": "cylinder"}}, "tips.shape"),
        ({"tips": {"shape": "cylinder", "fillet_mm": 0.1}}, "tips.shape"),
        ({"tips": {"shape": "sphere"}}, "tips.shape"),
        ({"tips": {"shape": "cone", "half_angle_deg": 70.0}}, "tips.shape"),
        ({"tips": {**LINE, "shape": "cylinder"}, "springs": SPRINGS}, "tips.shape"),
        ({"tips": {"fillet_mm": 0.1}}, "tips.fillet_mm"),
        ({"tips": {"layout": "line"}}, "tips.order"),
        ({"tips": {"order": "LHL"}}, "tips.order"),
        ({"tips": {"layout": "square", "outer_mm": 0.1}}, "tips.outer_mm"),
        ({"tips": SQUARE}, "springs.K_l_N_per_m"),
        ({"tips": {**LINE, "spacing_mm": 9.8}, "springs": SPRINGS}, "tips.spacing_mm"),
        ({"tips": SQUARE, "springs": SPRINGS, "fruit": {"width_mm": 5.0}}, "tips.spacing_mm"),
        ({"reading": {}, "press": {"tilt_deg": 2.0}}, "press.tilt_deg"),
        ({"reading": {}, "springs": SPRINGS, "targets": {}}, "targets.P_max"),
        ({"print": {"process_file": "own.toml"}}, "print.process_file"),
        (read_on({"radius_mm": [42.0, 53.0]}), "reading.radius_across_mm"),
        (read_on({"radius_across_mm": [42.0, 53.0]}), "reading.radius_mm"),
        *(
            (read_on({**RADII, key: bad}), f"reading.{key}")
            for key in ("radius_mm", "radius_across_mm", "thickness_mm")
            for bad in ([53.0, 42.0], [42.0], [42.0, 50.0, 53.0], [], 42.0, [0.0, 42.0], ["a", 42.0])
        ),
        *((read_on(RADII, fruit), "reading.radius_mm") for fruit in ({}, SPHERE)),
        *(
            ({"fruit": {"roughness_wave_mm": bad}}, "fruit.roughness_wave_mm")
            for bad in ([8.0, 2.0], [2.0], [2.0, 4.0, 8.0], [], 4.0, [0.0, 4.0], ["a", 4.0])
        ),
        *(({"fruit": {"roughness_mm": bad}}, "fruit.roughness_mm") for bad in (-0.01, 1.5, "a")),
        *(({"fruit": {"flesh_scatter_percent": bad}}, "fruit.flesh_scatter_percent") for bad in (-1.0, 51.0)),
        *((read_on({"presses": bad}), "reading.presses") for bad in (0, 2.5, 101)),
        *(({"reading": {}, "bench": {key: bad}}, f"bench.{key}") for key in BENCH for bad in (0.0, -1.0, 1e9, "a")),
        ({"reading": {}, "bench": {"balance_g": 10.0, "balance_max_g": 10.0}}, "bench.balance_g"),
        ({"reading": {}, "bench": {"balance": 0.01}}, "bench.balance"),
        ({"bench": {}}, "bench.balance_g"),
        ({"reading": {"stiffness_percent": 1.0, "gain_percent": 1.0}, "bench": {}}, "bench.balance_g"),
        (read_on({"thickness_mm": [8.0, 20.0]}, {}), "reading.thickness_mm"),
        (read_on({"thickness_mm": [8.0, 20.0]}, tips=SQUARE), "reading.thickness_mm"),
        *(
            (read_on({"uncertainty_limit": bad}, {"E_MPa": [0.5, 3.5]}), "reading.uncertainty_limit")
            for bad in ([0.1], [0.1, 0.1, 0.1], [], [0.1, 0.0], [0.1, "a"])
        ),
        (read_on(RADII, ELLIPSOID), "fruit.length_mm"),
        (read_on({"tilt_change_deg": -0.5}), "reading.tilt_change_deg"),
        ({"fruit": {"skin_poisson": 0.4}}, "fruit.skin_poisson"),
        ({"fruit": {**SPHERE, "height_mm": 13.0, "thickness_mm": 11.0}}, "fruit.height_mm"),
        ({"reading": {}, "press": {"tilt_spread_deg": 2.0}}, "press.tilt_spread_deg"),
        ({"reading": {"radius_spread": 0.1}}, "reading.radius_spread"),
        (read_on({**RADII, "radius_spread": 0.1}), "reading.radius_spread"),
        *(
            ({"tips": LINE, "springs": SPRINGS, table: {key: value}}, f"{table}.{key}")
            for table, key, value in (
                ("press", "attitude", "down"),
                ("print", "max_length_mm", 100.0),
                ("print", "E_MPa", 2000.0),
                ("print", "mount", "washers"),
            )
        ),
    ],
)
def test_bad_table_is_one_line_that_names_the_field(tables, field):
    with pytest.raises(InputError) as error:
        design_from_mapping(tables)
    assert error.value.field == field
    assert len(str(error.value).splitlines()) == 1


@pytest.mark.parametrize("name", [name for name in GONE if name.partition(".")[0] in TABLES])
def test_key_that_is_gone_is_refused_with_what_to_use(name):
    """In a table, in a setting, and where a setting unsets it: it is not told as a key that is spelt wrong."""
    table, _, key = name.partition(".")
    for tables, settings in (({table: {key: "something"}}, {}), ({}, {name: "2"}), ({}, {name: ""})):
        with pytest.raises(InputError) as error:
            DesignTables(tables=tables).design(settings_of_texts(settings))
        assert error.value.field == name
        assert str(error.value).endswith(f" {GONE[name]}")


@pytest.mark.parametrize(
    ("settings", "field"),
    [
        ({"NL": "0.1"}, "NL"),
        ({"target.NL": "0.1"}, "target.NL"),
        ({"targets.NLL": "0.1"}, "targets.NLL"),
        ({"targets.NLL": ""}, "targets.NLL"),
        ({"targets.NL": "nan"}, "targets.NL"),
        ({"targets.NL": "true"}, "targets.NL"),
        ({"targets.NL": "\u0660.\u0660\u0663"}, "targets.NL"),
        ({"tips.side_mm": "{" + ".".join(5000 * ["a"]) + " = 1}"}, "tips.side_mm"),
        ({"targets.NL": "0.1\nP_max = 3"}, "targets.NL"),
        ({"targets.NL": 3000 * "[" + 3000 * "]"}, "targets.NL"),
        ({"targets.P_max": "1" * 5000}, "targets.P_max"),
        ({"fruit.radius_mm": ""}, "fruit.radius_mm"),
    ],
)
def test_bad_setting_is_one_line_that_names_the_field(settings, field):
    with pytest.raises(InputError) as error:
        DesignTables(tables={"fruit": SPHERE}).design(settings_of_texts(settings))
    assert error.value.field == field
    assert len(str(error.value).splitlines()) == 1


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
        DesignTables(tables={"targets": 5}).changed({"targets.NL": 0.1})
    assert error.value.field == "targets"


@pytest.mark.parametrize(("thickness", "hint"), [(0.9, "take 0.8 or 1.2 mm"), (0.1, "take 0.4 or 0.8 mm")])
def test_leaf_of_no_whole_number_of_lines_is_told_the_nearest_ones(thickness, hint):
    with pytest.raises(InputError) as error:
        design_from_mapping({"print": {"leaf_thickness_high_mm": thickness}})
    assert error.value.bound.startswith("a whole number of lines of 0.4 mm")
    assert hint in str(error.value).lower()
