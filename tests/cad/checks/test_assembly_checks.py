"""Verdicts on a cover: its own passes, and what a wrong one is told."""

import math
from dataclasses import replace

import cadquery as cq
import pytest

from cad.checks.assembly_checks import cover_verdicts
from cad.design.fruit import Fruit
from cad.design.processes import PROCESSES
from cad.design.tips import Press
from cad.parts.cover import RECESS_MM, cover_of, cover_part
from cad.parts.housing import SETBACK_MM
from cad.parts.housing_solid import housing_part

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


@pytest.mark.parametrize("recess", [0.0, 0.2])
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
