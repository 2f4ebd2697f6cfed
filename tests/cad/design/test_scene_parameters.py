"""Keys that make a scene of contact: fruit shapes, tip shapes, fillet, offset and roll."""

import dataclasses
import math
import re
import tomllib
from pathlib import Path

import pytest

from cad.design.design_file import design_as_toml, design_from_mapping, read_design
from cad.design.fruit import Fruit
from cad.design.parameters import Design
from cad.design.tips import Press, Tips
from cad.quantity import InputError

DESIGNS = Path(__file__).parents[3] / "designs"
SPHERE = {"shape": "sphere", "radius_mm": 35.0}
ELLIPSOID = {"shape": "ellipsoid", "radius_mm": 40.0, "radius_across_mm": 30.0, "thickness_mm": 10.0}


def refused(text):
    return pytest.raises(InputError, match=rf"^{re.escape(text)}.*: must be [^\n]*; [^\n]*$")


def test_defaults_are_the_papers_flat_scene():
    design = Design()
    assert (design.fruit.shape, design.tips.shape, design.tips.fillet_mm, design.press.roll_deg) == (
        "block",
        "cube",
        0.0,
        0.0,
    )
    assert design.fruit.radius_mm is design.fruit.radius_across_mm is design.fruit.thickness_mm is None
    assert design.fruit.equivalent_block == design.fruit
    assert design.tips.flat == design.tips


@pytest.mark.parametrize(
    ("keys", "fault"),
    [
        ({"shape": "pear"}, "fruit.shape = 'pear': must be one of block, sphere, ellipsoid"),
        ({"shape": "sphere"}, "fruit.radius_mm = None: must be given for fruit.shape = 'sphere'"),
        ({"shape": "ellipsoid", "radius_mm": 35.0}, "fruit.radius_across_mm = None: must be given"),
        ({"radius_mm": 35.0}, "fruit.radius_mm = 35 mm: must be left out for fruit.shape = 'block'"),
        ({"radius_across_mm": 35.0}, "fruit.radius_across_mm = 35 mm: must be left out"),
        ({"thickness_mm": 10.0}, "fruit.thickness_mm = 10 mm: must be left out"),
        ({**SPHERE, "radius_across_mm": 35.0}, "fruit.radius_across_mm = 35 mm: must be left out"),
        ({**SPHERE, "radius_mm": 0.0}, "fruit.radius_mm = 0 mm: must be at least 1e-06 and at most 1000"),
        ({**SPHERE, "radius_mm": math.nan}, "fruit.radius_mm = nan mm"),
        ({**SPHERE, "thickness_mm": 71.0}, "fruit.thickness_mm = 71 mm: must be at most 2 fruit.radius_mm = 70 mm"),
        ({**SPHERE, "height_mm": 71.0}, "fruit.height_mm = 71 mm: must be at most 2 fruit.radius_mm = 70 mm"),
        # the corner of the piece lies sqrt(2) 25 = 35.4 mm from the axis, beyond the fruit
        ({**SPHERE, "length_mm": 50.0, "width_mm": 50.0}, "fruit.length_mm = 50 mm: must be so small that the corners"),
        # it lies 2.98 mm below the apex, under the base
        (
            {**SPHERE, "length_mm": 20.0, "width_mm": 20.0, "thickness_mm": 2.9},
            "fruit.length_mm = 20 mm: must be so small that the corners",
        ),
    ],
)
def test_bad_fruit_is_refused(keys, fault):
    with refused(fault.partition(": must")[0]) as raised:
        Fruit(**keys)
    assert fault in str(raised.value)


def test_the_plan_of_a_curved_fruit_follows_from_its_radius_and_thickness():
    cap = Fruit(**SPHERE, thickness_mm=12.0)  # its base is a circle of half width sqrt(35^2 - 23^2)
    assert cap.length_mm == cap.width_mm == pytest.approx(2.0 * math.sqrt(35.0**2 - 23.0**2))
    assert cap.whole
    assert Fruit(**SPHERE, thickness_mm=65.0).length_mm == 70.0
    ellipsoid = Fruit(shape="ellipsoid", radius_mm=35.0, radius_across_mm=20.0, thickness_mm=65.0)
    assert (ellipsoid.length_mm, ellipsoid.width_mm) == (70.0, pytest.approx(2.0 * math.sqrt(35.0 * 20.0)))
    piece = Fruit(**SPHERE, length_mm=20.0, width_mm=20.0)
    assert (piece.length_mm, piece.width_mm, piece.whole) == (20.0, 20.0, False)
    assert (Fruit().length_mm, Fruit().width_mm, Fruit().whole) == (20.0, 20.0, False)


@pytest.mark.parametrize(
    ("keys", "fault"),
    [
        ({"shape": "cone"}, "tips.shape = 'cone': must be one of cube, cylinder, sphere"),
        ({"fillet_mm": -0.1}, "tips.fillet_mm = -0.1 mm: must be at least 0"),
        ({"fillet_mm": 0.5}, "tips.fillet_mm = 0.5 mm: must be less than tips.side_mm / 2 = 0.5 mm"),
        ({"shape": "sphere", "fillet_mm": 0.1}, "tips.fillet_mm = 0.1 mm: must be 0 for tips.shape = 'sphere'"),
        ({"offset_mm": math.inf}, "tips.offset_mm = inf mm"),
    ],
)
def test_bad_tips_are_refused(keys, fault):
    with refused(fault.partition(": must")[0]) as raised:
        Tips(**keys)
    assert fault in str(raised.value)


@pytest.mark.parametrize("roll", [-31.0, 31.0, math.nan])
def test_bad_roll_is_refused(roll):
    with refused(f"press.roll_deg = {roll:g} deg"):
        Press(roll_deg=roll)


@pytest.mark.parametrize("offset", [5.6, -5.6])
def test_tips_off_the_fruit_are_refused(offset):
    with refused("tips.spacing_mm = 8 mm"):
        Design(tips=Tips(offset_mm=offset))


def test_press_through_the_thickness_is_refused():
    fruit = Fruit(**{**SPHERE, "thickness_mm": 4.0})
    with refused("press.travel_mm = 5 mm: must be less than fruit.thickness_mm = 4 mm".partition(": must")[0]):
        Design(fruit=fruit, press=Press(travel_mm=5.0))


def test_fall_is_that_of_the_circle_and_of_the_ellipse():
    sphere = Fruit(**SPHERE)
    assert sphere.fall_mm(4.0, 0.0) == pytest.approx(35.0 - math.sqrt(35.0**2 - 4.0**2), rel=1e-12)
    assert sphere.fall_mm(0.0, 4.0) == sphere.fall_mm(4.0, 0.0)
    assert sphere.fall_mm(36.0, 0.0) == math.inf
    ellipsoid = Fruit(**ELLIPSOID)
    # radius of curvature of an ellipse with semi-axes a across and c up is a^2 / c
    semi_axis = math.sqrt(30.0 * 40.0)
    assert ellipsoid.fall_mm(0.0, 5.0) == pytest.approx(
        40.0 * (1.0 - math.sqrt(1.0 - (5.0 / semi_axis) ** 2)), rel=1e-12
    )
    assert Fruit().fall_mm(3.0, 1.0) == 0.0


def test_equivalent_block_has_the_plan_and_the_thickness():
    block = Fruit(**ELLIPSOID, length_mm=20.0, width_mm=18.0, poisson=0.45).equivalent_block
    assert block == Fruit(width_mm=18.0, height_mm=10.0, poisson=0.45)
    assert Fruit(**SPHERE, length_mm=20.0, width_mm=20.0).equivalent_block == Fruit()


@pytest.mark.parametrize(("shape", "flat"), [("cube", "cube"), ("cylinder", "cylinder"), ("sphere", "cylinder")])
def test_flat_tips_keep_the_outline(shape, flat):
    tips = Tips(shape=shape, side_mm=2.0, offset_mm=1.0)
    assert tips.flat == Tips(shape=flat, side_mm=2.0, offset_mm=1.0)
    assert Tips(fillet_mm=0.1).flat == Tips()


def test_new_keys_survive_a_design_file():
    design = Design(
        fruit=Fruit(**ELLIPSOID),
        tips=Tips(shape="cylinder", fillet_mm=0.1, offset_mm=1.5),
        press=Press(tilt_deg=-1.0, roll_deg=2.0),
    )
    assert design_from_mapping(tomllib.loads(design_as_toml(design))) == design
    assert dataclasses.asdict(design)["press"]["roll_deg"] == 2.0


@pytest.mark.parametrize("path", sorted(DESIGNS.glob("*.toml")), ids=lambda path: path.stem)
def test_presets_are_designs_and_survive_a_design_file(path):
    design = design_from_mapping(read_design(path))
    assert design.name == path.stem
    assert design_from_mapping(tomllib.loads(design_as_toml(design))) == design


def test_every_number_of_a_preset_says_where_it_comes_from():
    for path in DESIGNS.glob("*.toml"):
        for line in path.read_text(encoding="utf-8").splitlines():
            assert "=" not in line or line.startswith(("#", "name")) or "#" in line, f"{path.name}: {line}"
