"""Verdicts on a cover and on the two plates of a square: their own pass, and what wrong ones are told."""

import math
from dataclasses import replace

import cadquery as cq
import pytest
from squares import RESIN, square_sensor

from cad.checks.assembly_checks import cover_verdicts, plate_verdicts
from cad.design.fruit import Fruit
from cad.design.processes import PROCESSES
from cad.design.tips import Press
from cad.parts.cover import RECESS_MM
from cad.parts.cover_solid import cover_of, cover_part
from cad.parts.housing import SETBACK_MM
from cad.parts.housing_solid import housing_part, named_housing

PETG = PROCESSES["fdm-petg"]
KERNEL = 1e-6


def named(findings, name):
    (finding,) = (each for each in findings if each.name == f"geometry.{name}")
    return finding


@pytest.fixture(scope="module")
def cover(sensor):
    return cover_of(sensor)


def test_all_pass_and_clearance_is_the_recess(sensor, cover):
    findings = cover_verdicts(sensor, cover_part(cover).shape, PETG)
    assert [one.name for one in findings if one.passed is not True] == []
    assert named(findings, "cover_clearance").value == pytest.approx(min(RECESS_MM, SETBACK_MM), abs=1e-4)


@pytest.mark.parametrize("recess", [0.05, 0.2])
def test_cover_without_enough_recess_fails(sensor, cover, recess):
    flat = cover_part(replace(cover, recess=recess))
    found = named(cover_verdicts(sensor, flat.shape, PETG), "cover_clearance")
    assert (found.passed, found.value) == (False, pytest.approx(recess, abs=KERNEL))


def test_rim_that_a_shuttle_reaches_at_its_stop_fails(sensor, cover):
    """A rib over the low shuttle, 0.2 mm above it at rest, lies beside it when it is at its stop 0.75 mm up."""
    housing, part = sensor.housing, cover_part(cover)
    z = housing.low_top_level + 0.2
    rib = cq.Solid.makeBox(2.0, RECESS_MM, 1.0, cq.Vector(-5.0, 0.5 * housing.depth, z))
    ribbed = part.shape.fuse(rib)
    found = named(cover_verdicts(sensor, ribbed, PETG), "cover_clearance")
    assert (found.passed, found.value) == (False, pytest.approx(0.0, abs=KERNEL))
    assert "to the stop" in found.reference


def test_cover_of_a_longer_housing_does_not_match_its_holes(sensor, cover):
    longer = replace(cover, housing=replace(sensor.housing, low=replace(sensor.housing.low, length=25.4)))
    found = named(cover_verdicts(sensor, cover_part(longer).shape, PETG), "cover_holes")
    # Half a turn is about the middle of the housing: the front cover is then off by as much, the other way.
    assert (found.passed, found.value) == (False, pytest.approx(0.4, abs=KERNEL))
    solid = cq.Solid.makeBox(1.0, 1.0, 1.0, cq.Vector(0.0, 10.0, 40.0))
    none = named(cover_verdicts(sensor, solid, PETG), "cover_holes")
    assert (none.passed, none.value) == (False, None)
    assert none.reference == "0 holes in the back cover, 4 in the housing: must be 4 each"


def test_foot_is_never_lower_over_a_large_fruit_than_the_frame(sensor):
    """Beyond every edge of the fruit the lowest corner is the frame's own, by the set-back of the foot."""
    wide = replace(sensor, fruit=Fruit(length_mm=300.0, width_mm=300.0), press=Press(roll_deg=5.0))
    housing = replace(sensor.housing, protrusion=5.0, lower_leaf_level=6.8)
    wide = replace(wide, housing=housing, part=housing_part(housing))
    cover = cover_of(wide)
    found = named(cover_verdicts(wide, cover_part(cover).shape, PETG), "cover_over_fruit")
    corners = [(x, 6.0) for x in (housing.left, housing.right)]
    ways = [math.radians(22.5 * step) for step in range(16)]
    reach = max(abs(x * math.cos(way) + y * math.sin(way)) for x, y in corners for way in ways)
    turn = math.radians(5.0)
    assert found.value == pytest.approx(
        cover.foot_level * math.cos(turn) - reach * math.sin(turn) - wide.press.travel_mm, abs=2e-3
    )
    low = cover_part(replace(cover, foot_level=0.2))
    assert named(cover_verdicts(wide, low.shape, PETG), "cover_over_fruit").passed is False


@pytest.fixture(scope="module")
def square():
    return square_sensor()


def test_single_plate_has_no_verdict_on_two(sensor):
    assert plate_verdicts(sensor) == ()


def test_plates_of_a_square_pass_and_keep_twice_their_pads_apart(square):
    findings = (*plate_verdicts(square), *cover_verdicts(square, cover_part(cover_of(square)).shape, RESIN))
    assert [one.name for one in findings if one.passed is not True] == []
    assert named(findings, "plates").value == pytest.approx(2.0 * square.housing.pad_height, abs=KERNEL)
    assert named(findings, "plate_holes").value == pytest.approx(0.0, abs=KERNEL)


def test_plates_deeper_than_the_square_run_into_each_other(square):
    """Half a millimetre too deep each: their frames overlap by it, whatever their pads."""
    housing = square.housing
    deep = {kind: replace(getattr(housing, kind), depth=6.5) for kind in ("low", "high")}
    found = named(plate_verdicts(square_sensor(replace(housing, **deep))), "plates")
    assert (found.passed, found.value) == (False, None)
    assert found.reference.startswith("the plates run into each other")


def test_plates_without_pads_rub(square):
    housing = replace(square.housing, pad_height=0.0, spacing=5.6, shuttle_width=5.3, tip_side=5.3)
    found = named(plate_verdicts(square_sensor(housing)), "plates")
    assert (found.passed, found.value) == (False, pytest.approx(0.0, abs=KERNEL))


def test_plates_whose_pads_do_not_meet_fail(square):
    found = named(plate_verdicts(square_sensor(replace(square.housing, pad_height=0.1))), "plates")
    assert (found.passed, found.value) == (False, None)
    assert found.reference == "the pads of the plates do not meet: screws would bend the plates by 0.2 mm"


def test_shuttle_that_stands_out_of_its_plate_fails(square):
    """A rib on the back of the low shuttle leaves 0.1 mm to the other plate."""
    housing = square.housing
    corner = cq.Vector(-0.5 * housing.spacing - 1.0, 0.5 * housing.depth, 0.5 * housing.top_level)
    rib = cq.Solid.makeBox(2.0, 0.3, 2.0, corner)
    ribbed = replace(square, part=replace(square.part, shape=square.part.shape.fuse(rib)))
    found = named(plate_verdicts(ribbed), "plates")
    assert (found.passed, found.value) == (False, pytest.approx(0.1, abs=KERNEL))


def test_holes_that_do_not_meet_those_of_the_turned_plate_fail(square):
    """A plate whose short arm has a wall of its own has its holes nearer to the middle there."""
    housing = replace(square.housing, back_to_back=False)
    single = replace(square, part=housing_part(housing))
    found = named(plate_verdicts(single), "plate_holes")
    assert (found.passed, found.value) == (False, None)
    assert found.reference == "4 holes for screws and dowels in a plate: must be 6"


def test_dowel_hole_off_its_place_by_a_tenth_is_off_against_the_turned_plate(square):
    """One of the two holes is drilled 0.1 mm farther out: its partner comes to stand as far on the other side."""
    blank = replace(square.housing, dowel_hole=0.0)
    (x, z), (other_x, _) = square.housing.dowels
    drill = cq.Workplane("XZ", origin=(0.0, 10.0, 0.0)).pushPoints([(x - 0.1, z), (other_x, z)])
    holes = drill.circle(0.5 * square.housing.dowel_hole).extrude(20.0).findSolid()
    plate = named_housing(housing_part(blank).shape.cut(holes), blank)
    found = named(plate_verdicts(replace(square, part=plate)), "plate_holes")
    assert (found.passed, found.value) == (False, pytest.approx(0.1, abs=KERNEL))
