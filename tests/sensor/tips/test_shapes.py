"""Shapes of tips: what each key may be, and the meridian that gap and solid follow from."""

import itertools
import math

import pytest
from refusal import refusal

from cad.parts.pin_socket import tip_solid
from sensor.design.tips import Tips
from sensor.theory.hertz import force_factor
from sensor.theory.sneddon_cone import cone_contact_radius, cone_force
from sensor.tips.cone import Cone
from sensor.tips.shapes import SHAPES
from sensor.tips.tip_shape import LEAST_PIECE_MM

SHAPE_KEYS = {
    "cube": {"fillet_mm": 0.2},
    "cylinder": {"fillet_mm": 0.2},
    "sphere": {},
    "dome": {"dome_radius_mm": 2.0},
    "cone": {"half_angle_deg": 70.0, "blunt_mm": 0.3},
}


@pytest.mark.parametrize("name", SHAPES)
def test_a_meridian_runs_from_the_point_to_the_rim_without_a_step(name):
    shape = Tips(shape=name, side_mm=2.0, **SHAPE_KEYS[name]).tip_shape
    pieces = shape.meridian
    assert pieces[0].start == (0.0, 0.0)
    assert pieces[-1].end.r == pytest.approx(1.0)
    for first, second in itertools.pairwise(pieces):
        assert first.end == pytest.approx(second.start)
    assert Tips(shape=name, side_mm=2.0, **SHAPE_KEYS[name]).flat.tip_shape.is_flat
    assert shape.flank_deg == pytest.approx(20.0 * (name == "cone"), rel=1e-12)
    assert shape.is_solved_under_skin == (name in ("cube", "cylinder", "dome"))
    assert shape.obeys_hertz == shape.touches_beside_centre == (name == "dome")


def test_the_solid_of_a_blunt_cone_has_its_volume():
    side, angle, blunt = 2.0, math.radians(70.0), 0.3
    shape = Tips(shape="cone", side_mm=side, half_angle_deg=70.0, blunt_mm=blunt).tip_shape
    edge, cap = blunt * math.cos(angle), blunt * (1.0 - math.sin(angle))
    rise = (1.0 - edge) / math.tan(angle)
    assert shape.height_mm == pytest.approx(cap + rise)
    ball = math.pi * cap**2 * (blunt - cap / 3.0)
    frustum = math.pi * rise / 3.0 * (1.0 + edge + edge**2)
    assert tip_solid(shape, 3.0).Volume() == pytest.approx(ball + frustum + math.pi * (3.0 - cap - rise), rel=1e-9)


def test_the_area_that_a_cone_touches_is_that_of_its_law():
    sharp = Tips(shape="cone", half_angle_deg=70.0).tip_shape
    area = sharp.contact_area_mm2(cone_force(0.1, 70.0, 2.0), 2.0, math.inf)
    assert area == pytest.approx(math.pi * cone_contact_radius(0.1, 70.0) ** 2, rel=1e-12)
    blunt = Tips(shape="cone", half_angle_deg=70.0, blunt_mm=0.5).tip_shape
    ball = Tips(shape="sphere", side_mm=1.0).tip_shape
    assert blunt.contact_area_mm2(1e-3, 2.0, 30.0) == pytest.approx(ball.contact_area_mm2(1e-3, 2.0, 30.0), rel=1e-12)


def test_the_stated_bound_of_a_spherical_point_is_its_largest_radius():
    stated = refusal(Cone, side_mm=2.0, half_angle_deg=70.0, blunt_mm=5.0).bound
    largest = float(stated.rpartition("= ")[2].removesuffix(" mm"))
    assert largest == pytest.approx(1.0 / math.cos(math.radians(70.0)), rel=1e-5)


@pytest.mark.parametrize("side", [0.1, 20.0])
@pytest.mark.parametrize(
    ("shape", "key", "half_angle"),
    [("cube", "fillet_mm", None), ("cylinder", "fillet_mm", None), ("cone", "blunt_mm", 45.0)],
)
def test_the_smallest_and_the_largest_rounding_give_a_solid(shape, key, half_angle, side):
    largest = 0.5 * side - LEAST_PIECE_MM
    if half_angle is not None:
        largest *= (1.0 - 1e-12) / math.cos(math.radians(half_angle))
    for rounding in (LEAST_PIECE_MM, largest):
        keys = {"shape": shape, "side_mm": side, "spacing_mm": 30.0, "half_angle_deg": half_angle, key: rounding}
        assert tip_solid(Tips(**keys).tip_shape, 4.0).isValid()


@pytest.mark.parametrize(("name", "force_power"), [("cube", 1.0), ("cylinder", 1.0), ("dome", 1.5)])
def test_mean_pressure_grows_by_the_power_that_the_shape_says(name, force_power):
    """Forces of a flat punch are proportional to the travel, those of Hertz to its power 3/2: four times as deep."""
    shape = Tips(shape=name, side_mm=2.0, **SHAPE_KEYS[name]).tip_shape
    first, second = (force_factor(2.0, 10.0) * depth**force_power for depth in (0.01, 0.04))
    pressures = [force / shape.contact_area_mm2(force, 2.0, math.inf) for force in (first, second)]
    assert pressures[1] / pressures[0] == pytest.approx(4.0**shape.pressure_exponent, rel=1e-12)
