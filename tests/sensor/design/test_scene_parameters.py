"""Keys that make a scene of contact: fruit shapes, tip shapes, fillet, offset and roll."""

import cmath
import math
import tomllib
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sensor.design.design_file import design_as_toml, design_from_mapping
from sensor.design.fruit import Fruit
from sensor.input_file import read_toml

DESIGNS = Path(__file__).parents[3] / "designs"
SPHERE = {"shape": "sphere", "radius_mm": 35.0}
ELLIPSOID = {"shape": "ellipsoid", "radius_mm": 40.0, "radius_across_mm": 30.0, "thickness_mm": 10.0}


def test_the_plan_of_a_curved_fruit_follows_from_its_radius_and_thickness():
    cap = Fruit(**SPHERE, thickness_mm=12.0)  # its base is a circle of half width sqrt(35^2 - 23^2)
    assert cap.length_mm == cap.width_mm == pytest.approx(2.0 * math.sqrt(35.0**2 - 23.0**2))
    assert cap.is_whole
    assert Fruit(**SPHERE, thickness_mm=65.0).length_mm == 70.0
    ellipsoid = Fruit(shape="ellipsoid", radius_mm=35.0, radius_across_mm=20.0, thickness_mm=65.0)
    assert (ellipsoid.length_mm, ellipsoid.width_mm) == (70.0, pytest.approx(2.0 * math.sqrt(35.0 * 20.0)))
    piece = Fruit(**SPHERE, length_mm=20.0, width_mm=20.0)
    assert (piece.length_mm, piece.width_mm, piece.is_whole) == (20.0, 20.0, False)
    assert (Fruit().length_mm, Fruit().width_mm, Fruit().is_whole) == (20.0, 20.0, False)


@given(u=st.floats(-50.0, 50.0), v=st.floats(-50.0, 50.0), azimuth=st.floats(0.0, 180.0, exclude_max=True))
def test_principal_directions_are_those_of_the_tips_turned_by_the_azimuth(u, v, azimuth):
    fruit = Fruit(**ELLIPSOID, length_mm=20.0, width_mm=20.0, azimuth_deg=azimuth)
    x, y = fruit.from_principal(u, v)
    assert complex(x, y) == pytest.approx(complex(u, v) * cmath.exp(1j * math.radians(azimuth)), abs=1e-12)
    assert fruit.to_principal(x, y) == pytest.approx((u, v), abs=1e-12)


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


@pytest.mark.parametrize("path", sorted(DESIGNS.glob("*.toml")), ids=lambda path: path.stem)
def test_presets_are_designs_and_survive_a_design_file(path):
    design = design_from_mapping(read_toml(path, "--design"))
    assert design.name == path.stem
    assert design_from_mapping(tomllib.loads(design_as_toml(design))) == design


def test_every_number_of_a_preset_says_where_it_comes_from():
    for path in DESIGNS.glob("*.toml"):
        for line in path.read_text(encoding="utf-8").splitlines():
            assert "=" not in line or line.startswith(("#", "name")) or "#" in line, f"{path.name}: {line}"


def test_equivalent_block_has_the_plan_and_the_thickness():
    block = Fruit(**ELLIPSOID, length_mm=20.0, width_mm=18.0, poisson=0.45).equivalent_block
    assert block == Fruit(width_mm=18.0, height_mm=10.0, poisson=0.45)
    assert Fruit(**SPHERE, length_mm=20.0, width_mm=20.0).equivalent_block == Fruit()
