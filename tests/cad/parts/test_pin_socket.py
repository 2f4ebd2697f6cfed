"""Sockets: pockets and pins by formula, what they give between its bounds, and what a wrong one is told."""

import math
from dataclasses import replace

import cadquery as cq
import pytest

from cad.checks.clearance import clearance_verdicts
from cad.checks.part_checks import check_file
from cad.checks.tip_checks import socket_verdicts
from cad.design.fruit import Fruit
from cad.design.parameters import Design
from cad.design.processes import PROCESSES
from cad.design.tips import Press, Tips
from cad.drawing.housing_drawing import housing_drawing
from cad.drawing.sheet import Title
from cad.fabrication.bridges import Bridge
from cad.fabrication.fabrication_sheet import SheetFacts, fabrication_sheet
from cad.files.sensor_files import write_sensor
from cad.files.step import read_step
from cad.parts.assembly import cover_pair, fasteners
from cad.parts.housing_solid import housing_part
from cad.parts.layout import housing_for
from cad.parts.pin import STEEL_MPA, pin_compliance
from cad.parts.pin_socket import pins, socketed, tip_solid
from cad.parts.sensor import Sensor
from cad.quantity import InputError

PETG = PROCESSES["fdm-petg"]
BRIDGE = Bridge(name="low", force=1.0, deflection=0.5, output=1.0, noise_mN=1.0)
PINS = Design(tips=Tips(socket="pin"))


@pytest.fixture(scope="module")
def foot():
    """PETG: pocket 1 + 2 x 0.05, foot 2 (1.1 + 0.8) for the walls around the pocket and its gable."""
    return housing_for(PINS, PETG, (20.0, 12.0), (0.5, 0.11))


@pytest.fixture(scope="module")
def pinned(foot):
    part = socketed(housing_part(foot), foot)
    return Sensor(housing=foot, part=part, fruit=PINS.fruit, tips=PINS.tips, press=PINS.press, name="paper")


def test_printed_tips_are_as_they_were(housing):
    part = housing_part(housing)
    assert socketed(part, housing) is part
    assert pins(housing, Tips()) == {}
    assert socket_verdicts(part, housing, Tips()) == ()
    assert (pin_compliance(housing, 2000.0, 0.38).compliance, pin_compliance(housing, 2000.0, 0.38).error) == (0.0, 0.0)


def test_layout_holds_the_pin_with_the_walls_of_the_process(foot):
    assert (foot.pin_side, foot.pin_out, foot.pocket_side, foot.pocket_depth, foot.tip_side) == pytest.approx(
        (1.0, 1.0, 1.1, 3.0, 3.8)
    )
    printed = housing_for(Design(), PETG, (20.0, 12.0), (0.5, 0.11))
    assert foot.protrusion + foot.pin_out == pytest.approx(printed.protrusion)


def test_pockets_are_a_square_and_a_gable_deep(foot):
    part = housing_part(foot)
    taken = part.shape.Volume() - socketed(part, foot).shape.Volume()
    assert taken == pytest.approx(2.0 * 3.0 * (1.1**2 + 0.25 * 1.1**2), rel=1e-6)


def test_faces_keep_their_names(foot):
    part = socketed(housing_part(foot), foot)
    assert part.face_area("low_tip") == pytest.approx(3.8**2 - 1.25 * 1.1**2)


def test_pins_fill_the_pockets_but_for_the_fit_and_stand_out(pinned, foot):
    placed = pins(foot, PINS.tips)
    assert list(placed) == ["low pin", "high pin"]
    for pin, x in zip(placed.values(), (-4.0, 4.0), strict=True):
        box = pin.BoundingBox()
        assert (box.zmin, box.zmax, box.center.x, box.xlen) == pytest.approx((-1.0, 3.0, x, 1.0), abs=1e-6)
        assert not pin.intersect(pinned.part.shape).Solids()


def test_finding_passes_on_its_own_pockets_and_fails_on_others(pinned, foot):
    (found,) = socket_verdicts(pinned.part, foot, PINS.tips)
    assert found.passed is True
    (none,) = socket_verdicts(housing_part(foot), foot, PINS.tips)
    assert (none.passed, none.value, none.reference) == (False, None, "no pocket that holds the low pin")
    (wide,) = socket_verdicts(socketed(housing_part(foot), replace(foot, pocket_side=1.3)), foot, PINS.tips)
    assert (wide.passed, wide.value) == (False, pytest.approx(0.2))  # of the gable's height
    (shallow,) = socket_verdicts(socketed(housing_part(foot), replace(foot, pocket_depth=2.9)), foot, PINS.tips)
    assert (shallow.passed, shallow.value) == (False, None)  # the pin cuts into the end


def test_fruit_is_as_far_from_the_feet_as_the_pins_stand_out(pinned):
    """The foot counts as neck: 1 mm out at a travel of 0.6 mm leaves 0.4; at 1.1 mm it would be pressed on."""
    (found,) = (one for one in clearance_verdicts(pinned) if one.name == "geometry.neck_clearance")
    assert (found.passed, found.value) == (True, pytest.approx(0.4, abs=1e-6))
    (deep,) = (
        one
        for one in clearance_verdicts(replace(pinned, press=Press(travel_mm=1.1)))
        if one.name == "geometry.neck_clearance"
    )
    assert (deep.passed, deep.value) == (False, pytest.approx(-0.1, abs=1e-6))


def test_files_hold_the_pockets_and_the_pins(pinned, tmp_path):
    written = write_sensor(pinned, tmp_path)
    assert [path.name for path in written] == [
        "housing.step", "assembly.step", "housing.stl", "housing.3mf", "pin.step",
    ]  # fmt: skip
    assert read_step(tmp_path / "pin.step").Volume() == pytest.approx(4.0)
    assert read_step(tmp_path / "housing.step").Volume() == pytest.approx(pinned.part.shape.Volume())
    steel = sum(shape.Volume() for shape in (*fasteners(pinned).values(), *cover_pair(pinned).values()))
    whole = pinned.part.shape.Volume() + 2.0 * 4.0 + steel + pinned.bodies()[-1].shape.Volume()
    assert read_step(tmp_path / "assembly.step").Volume() == pytest.approx(whole)
    assert [body.name for body in pinned.bodies()] == ["housing", "low pin", "high pin", "fruit"]
    failed = [one.name for one in check_file(tmp_path / "housing.3mf", PETG) if one.passed is not True]
    assert failed == []


def test_drawing_and_sheet_tell_of_the_pins(pinned, foot):
    title = Title(name="paper", process=PETG)
    space = housing_drawing(pinned.part, foot, title).canvas.space
    assert "steel pin 1 x 1 x 4 2x, 1 out" in [entity.dxf.text for entity in space.query("TEXT")]
    sheet = fabrication_sheet(pinned, title, SheetFacts(bill=(), bridges=(BRIDGE,)))
    assert "Two ground steel pins, 1 x 1 mm, 4 mm long" in sheet
    assert "Pockets are 1.1 mm wide and 3 mm deep" in sheet


def test_pocket_without_a_gable_would_hang_over(foot, tmp_path):
    part = housing_part(foot)
    boxes = [cq.Solid.makeBox(1.1, 1.1, 4.0, cq.Vector(x - 0.55, -0.55, -1.0)) for x in (-4.0, 4.0)]
    flat = Sensor(
        housing=foot,
        part=replace(part, shape=part.shape.cut(*boxes)),
        fruit=PINS.fruit,
        tips=PINS.tips,
        press=PINS.press,
    )
    write_sensor(flat, tmp_path)
    (found,) = (one for one in check_file(tmp_path / "housing.stl", PETG) if one.name == "geometry.overhang")
    assert (found.passed, found.value) == (False, pytest.approx(1.1, abs=1e-3))


# Solids of foot, glue and pin less a solid foot, in mm/N: tests/fits/glued_pin.py, bricks of half that size move it by
# 3e-6. The upper bound is a square punch on a half-space that nothing glues: F = 1.1523 E side d / (1 - nu^2).
def test_give_holds_that_of_solids_and_is_far_under_a_punch_that_is_not_glued(foot):
    found = pin_compliance(foot, 2000.0, 0.38)
    assert abs(found.compliance - (1.07e-5 + 1.0 / STEEL_MPA)) < found.error
    punch = (1.0 - 0.38**2) / (1.1523 * 2000.0)
    assert found.compliance + found.error < 0.2 * punch
    # The middle of rigid foot and punch, which stood here before, is outside.
    assert abs(0.5 * punch - found.compliance) > 3.0 * found.error


def test_glue_is_what_gives_in_a_foot_of_metal(foot):
    """A layer of 0.05 mm in shear on three sides of 1 x 3 mm: 0.05 / (1100 x 9) mm/N."""
    found = pin_compliance(foot, 1e9, 0.3)
    assert found.compliance == pytest.approx(0.05 / (1100.0 * 9.0) + 1.0 / STEEL_MPA, rel=1e-3)


@pytest.mark.parametrize(
    ("change", "field"),
    [
        ({"pocket_side": 0.9}, "pocket_side"), ({"pocket_side": 2.0}, "pocket_side"),
        ({"pocket_depth": 9.0}, "pocket_depth"), ({"pin_out": 0.0}, "pin_out"),
    ],
)  # fmt: skip
def test_pocket_that_cannot_be_is_refused(foot, change, field):
    with pytest.raises(InputError) as refused:
        replace(foot, **change)
    assert refused.value.field == f"housing.{field}"


def test_feet_that_would_touch_are_refused():
    close = Design(tips=Tips(socket="pin", spacing_mm=4.0))
    with pytest.raises(InputError) as refused:
        housing_for(close, PETG, (20.0, 12.0), (0.5, 0.11))
    assert (refused.value.field, refused.value.value) == ("tips.spacing_mm", 4.0)


def test_round_pin_gives_more_than_a_square_one():
    """The steel that stands out has pi / 4 of the square's section, the glue pi / 4 of its perimeter."""
    E, nu = 2000.0, 0.38
    square, round_one = (
        housing_for(Design(tips=Tips(shape=shape, socket="pin")), PROCESSES["fdm-petg"], (28.9, 14.8), (0.5, 0.11))
        for shape in ("cube", "cylinder")
    )
    assert (square.pin_round, round_one.pin_round) == (False, True)
    square_give, round_give = (pin_compliance(housing, E, nu) for housing in (square, round_one))
    assert round_give.compliance > square_give.compliance
    assert round_give.error > square_give.error
    steel = [
        pin_compliance(replace(h, pocket_side=h.pin_side + 1e-9), 1e12, 0.3).compliance for h in (square, round_one)
    ]
    assert steel[1] / steel[0] == pytest.approx(4.0 / math.pi, rel=1e-6)


def test_neck_above_a_wide_foot_prints_without_support(tmp_path):
    """A foot 0.8 mm short of the plate on each side: the step above it rises at 45 degrees."""
    design = Design(tips=Tips(socket="pin", side_mm=2.0, spacing_mm=12.0), fruit=Fruit(length_mm=40.0))
    process = PROCESSES["dmls-ti64"]
    housing = housing_for(design, process, (57.0, 32.0), (0.5, 0.11))
    assert 0.5 <= 0.5 * (housing.depth - housing.tip_side) < 1.0
    assert housing.neck_level - housing.tip_height == pytest.approx(0.5 * (housing.depth - housing.tip_side))
    part = housing_part(housing)
    whole = Sensor(housing=housing, part=part, fruit=design.fruit, tips=design.tips, press=design.press, name="wide")
    write_sensor(whole, tmp_path)
    (found,) = (one for one in check_file(tmp_path / "housing.3mf", process) if one.name == "geometry.overhang")
    assert found.passed, found.value


@pytest.mark.parametrize(
    ("tips", "volume", "touch"),
    [
        (Tips(side_mm=1.5), 1.5**2 * 3.0, 1.5**2),
        (Tips(shape="cylinder", side_mm=2.0), math.pi * 3.0, math.pi),
        (Tips(shape="sphere", side_mm=2.0), math.pi * 2.0 + 2.0 / 3.0 * math.pi, 2.0 * math.pi),
    ],
)
def test_tip_has_the_volume_and_the_face_of_its_shape(tips, volume, touch):
    solid = tip_solid(tips.tip_shape, 3.0)
    assert solid.isValid()
    assert solid.Volume() == pytest.approx(volume, rel=1e-9)
    down = [face for face in solid.Faces() if face.geomType() == "SPHERE" or face.normalAt().z < -0.5]
    assert [face.Area() for face in down] == [pytest.approx(touch, rel=1e-9)]
    box = solid.BoundingBox()
    assert (box.zmin, box.zmax, box.center.x) == pytest.approx((0.0, 3.0, 0.0), abs=1e-6)


@pytest.mark.parametrize(("shape", "flat"), [("cube", (1.0 - 2 * 0.1) ** 2), ("cylinder", math.pi * (0.5 - 0.1) ** 2)])
def test_fillet_leaves_the_flat_inside_it(shape, flat):
    solid = tip_solid(Tips(shape=shape, fillet_mm=0.1).tip_shape, 2.0)
    faces = [face for face in solid.Faces() if face.geomType() == "PLANE" and abs(face.Center().z) < 1e-6]
    assert [face.Area() for face in faces] == [pytest.approx(flat, rel=1e-9)]
