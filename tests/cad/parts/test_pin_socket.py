"""Sockets: pockets and pins by formula, and what they give between its bounds."""

import math
from dataclasses import replace

import numpy as np
import pytest

from cad.checks.triangle_checks import widest_ledge
from cad.files.stl import triangles
from cad.parts.housing_solid import housing_part
from cad.parts.layout import housing_for
from cad.parts.pin import STEEL_MPA, pin_compliance
from cad.parts.pin_socket import pin_locations, pin_solid, tip_solid
from cad.parts.pose import print_pose
from sensor.design.fruit import Fruit
from sensor.design.parameters import Design
from sensor.design.processes import PROCESSES
from sensor.design.tips import Tips
from sensor.quantity import InputError

PETG = PROCESSES["fdm-petg"]


def foot_of(process=PETG, **tips):
    return housing_for(Design(tips=Tips(socket="pin", **tips)), process, (20.0, 12.0), (0.5, 0.11))


@pytest.fixture(scope="module")
def foot(pinned):
    return pinned.housing


def overhang(part):
    """Return the width of the widest ledge [mm] as the part is printed."""
    return widest_ledge(triangles(print_pose(part.shape)), np.array([0.0, 0.0, 1.0]), 45.0)


def test_layout_holds_the_pin_with_the_walls_of_the_process(foot):
    pin = foot.pin
    sizes = (pin.side, pin.protruding_length, pin.pocket_side, pin.pocket_depth, foot.tip_side)
    assert sizes == pytest.approx((1.0, 1.0, 1.1, 3.0, 3.8))
    printed = housing_for(Design(), PETG, (20.0, 12.0), (0.5, 0.11))
    assert foot.protrusion + pin.protruding_length == pytest.approx(printed.protrusion)


def test_pockets_of_a_square_and_a_gable_leave_the_faces_their_names(pinned):
    assert pinned.part.face_area("low_tip") == pytest.approx(3.8**2 - 1.25 * 1.1**2)


def test_gable_is_the_roof_of_its_pocket_in_print(pinned, foot):
    """No ledge is as wide as a pocket; on the other side the gable would leave its level roof."""
    assert overhang(pinned.part) < 0.95 * foot.pin.pocket_side


def test_neck_above_a_wide_foot_prints_without_support():
    """A foot 0.8 mm short of the plate on each side: the step above it rises at 45 degrees."""
    design = Design(tips=Tips(socket="pin", side_mm=2.0, spacing_mm=12.0), fruit=Fruit(length_mm=40.0))
    housing = housing_for(design, PROCESSES["dmls-ti64"], (57.0, 32.0), (0.5, 0.11))
    step = 0.5 * (housing.depth - housing.tip_side)
    assert 0.5 <= step < 1.0
    assert housing.neck_level - housing.tip_height == pytest.approx(step)
    assert overhang(housing_part(housing)) < 1.0


def test_pins_fill_the_pockets_but_for_the_fit_and_stand_out(pinned, foot):
    places = pin_locations(foot)
    assert list(places) == ["low_pin", "high_pin"]
    for place, x in zip(places.values(), (-4.0, 4.0), strict=True):
        pin = pin_solid(foot.pin, Tips()).moved(place)
        box = pin.BoundingBox()
        assert (box.zmin, box.zmax, box.center.x, box.xlen) == pytest.approx((-1.0, 3.0, x, 1.0), abs=1e-6)
        assert not pin.intersect(pinned.part.shape).Solids()


def test_give_holds_that_of_solids_and_is_far_under_a_punch_that_is_not_glued(foot):
    """1.07e-5 mm/N: 20-node bricks of foot, gable, glue and pin less those of a solid foot.

    The upper bound is a square punch on a half-space that nothing glues: F = 1.1523 E side d / (1 - nu^2).
    """
    found = pin_compliance(foot.pin, 2000.0, 0.38)
    assert abs(found.value - (1.07e-5 + 1.0 / STEEL_MPA)) < found.error
    punch = (1.0 - 0.38**2) / (1.1523 * 2000.0)
    assert found.value + found.error < 0.2 * punch


@pytest.mark.parametrize(("shape", "area"), [("cube", 1.0), ("cylinder", 0.25 * math.pi)])
def test_glue_and_steel_are_what_gives_in_a_foot_of_metal(shape, area):
    """1 mm of steel, and a layer of 0.05 mm in shear on three sides of 1 x 3 mm; both have pi / 4 of it when round."""
    pin = foot_of(shape=shape).pin
    assert pin.is_round == (shape == "cylinder")
    found = pin_compliance(pin, 1e9, 0.3)
    glue = 0.05 / (1100.0 * 9.0 * area)
    assert found.value == pytest.approx(glue + 1.0 / (STEEL_MPA * area), rel=1e-3)
    assert found.error == pytest.approx(0.5 * glue, rel=1e-3)


@pytest.mark.parametrize(
    ("sizes", "key"),
    [
        ({"pocket_side": 1.0}, "pocket_side"),  # as wide as the pin
        ({"pocket_side": 1.9}, "pocket_side"),  # half the foot
        ({"pocket_depth": 9.0}, "pocket_depth"),
        ({"pocket_depth": 0.0}, "pocket_depth"),
        ({"protruding_length": 0.0}, "pin_out"),
        ({"side": 0.0}, "pin_side"),
    ],
)
def test_pocket_that_cannot_be_is_refused(foot, sizes, key):
    with pytest.raises(InputError) as refused:
        replace(foot, pin=replace(foot.pin, **sizes))
    assert refused.value.field == f"housing.{key}"


def flat_tip(shape, fillet):
    """Return a flat tip of 1.5 mm, its volume up to 4 mm and its face, which is a wide.

    Its width over the rounding is a + 2 sqrt(2 f z - z^2).
    """
    share = 1.0 if shape == "cube" else 0.25 * math.pi
    a = 1.5 - 2.0 * fillet
    rounded = a**2 * fillet + math.pi * a * fillet**2 + 8.0 / 3.0 * fillet**3
    tips = Tips(shape=shape, side_mm=1.5, fillet_mm=fillet)
    return tips, share * (1.5**2 * (4.0 - fillet) + rounded), share * a**2


def dome(radius, **tips):
    """Return a dome of 2 mm or half a ball, its volume up to 4 mm, and the area of its cap."""
    cap = radius - math.sqrt(radius**2 - 1.0)
    volume = math.pi * (4.0 - cap) + math.pi * cap**2 * (radius - cap / 3.0)
    return Tips(side_mm=2.0, **tips), volume, 2.0 * math.pi * radius * cap


@pytest.mark.parametrize(
    ("tips", "volume", "face"),
    [
        *(flat_tip(shape, fillet) for shape in ("cube", "cylinder") for fillet in (0.0, 0.1)),
        *(dome(radius, shape="dome", dome_radius_mm=radius) for radius in (10.0, 1.0)),
        dome(1.0, shape="sphere"),
    ],
)
def test_tip_has_the_volume_and_the_face_of_its_shape(tips, volume, face):
    solid = tip_solid(tips.tip_shape, 4.0)
    assert solid.isValid()
    box = solid.BoundingBox()
    assert (box.zmin, box.zmax, box.center.x) == pytest.approx((0.0, 4.0, 0.0), abs=1e-6)
    assert solid.Volume() == pytest.approx(volume, rel=1e-9)
    assert min(solid.Faces(), key=lambda each: each.Center().z).Area() == pytest.approx(face, rel=1e-9)
