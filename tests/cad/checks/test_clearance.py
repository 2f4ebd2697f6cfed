"""Clearance of the fruit and travel to the stops, measured on the solid, against plain geometry."""

import math
from dataclasses import replace

import cadquery as cq
import pytest

from cad.checks.clearance import clearance_verdicts, stop_verdicts
from cad.parts.housing_solid import housing_part
from sensor.design.fruit import Fruit
from sensor.design.tips import PressMotion

KERNEL = 1e-6
MOVED = 3.0 * 0.6**2 - 2.0 * 0.6**3  # of a guided leaf's end at 0.6 of its length
LEFT_AT_STOP = 0.75 * MOVED  # [mm] by which that point has risen when the shuttle is stopped


def with_housing(sensor, **changes):
    housing = replace(sensor.housing, **changes)
    return replace(sensor, housing=housing, part=housing_part(housing))


def over_large_fruit(sensor, protrusion):
    return with_housing(replace(sensor, fruit=Fruit(length_mm=200.0, width_mm=200.0)), protrusion=protrusion)


def lowest_corner(housing, tilt):
    """Return the level of the lowest bottom corner of the frame when the sensor tilts one of the 16 ways [mm]."""
    corners = [(x, y) for x in (housing.left, housing.right) for y in (-0.5 * housing.depth, 0.5 * housing.depth)]
    ways = [math.radians(22.5 * step) for step in range(16)]
    reach = max(x * math.cos(way) + y * math.sin(way) for x, y in corners for way in ways)
    return housing.protrusion * math.cos(tilt) - reach * math.sin(tilt)


@pytest.mark.parametrize(("protrusion", "tilt", "passes"), [(3.4, 0.0, True), (2.4, 0.0, False), (3.4, -8.0, False)])
def test_frame_over_a_large_fruit_is_as_near_as_its_lowest_corner(sensor, protrusion, tilt, passes):
    """It tilts by 3 degrees, or as the press does where that is more."""
    large = replace(over_large_fruit(sensor, protrusion), press=PressMotion(tilt_deg=tilt))
    expected = lowest_corner(large.housing, math.radians(max(3.0, abs(tilt)))) - large.press.travel_mm
    frame, _ = clearance_verdicts(large)
    assert (frame.name, frame.passed) == ("geometry.frame_clearance", passes)
    if tilt == 0.0:  # a frame that reaches below the fruit's top at its side does so by less than its corner
        assert frame.value == pytest.approx(expected, abs=KERNEL)


def test_frame_beside_a_small_fruit_is_as_far_as_its_side(sensor):
    """The right wall is at x = 20, the fruit ends at 10: the fall of 3 degrees turns it by little."""
    wall = sensor.housing.arms[1].wall
    frame, _ = clearance_verdicts(sensor)
    assert wall - 10.0 - 1.0 < frame.value < wall - 10.0 + 0.1


@pytest.mark.parametrize(("travel", "passes"), [(0.6, True), (1.01, False)])
def test_neck_stands_over_the_fruit_by_tip_height_less_travel(sensor, travel, passes):
    _, neck = clearance_verdicts(replace(sensor, press=PressMotion(travel_mm=travel)))
    assert (neck.value, neck.passed) == (pytest.approx(1.0 - travel, abs=KERNEL), passes)


def stops(sensor, deflections=(0.55, 0.2)):
    """Return by name the verdicts on stops and on what is left between leaf and frame."""
    return {verdict.name.removeprefix("geometry."): verdict for verdict in stop_verdicts(sensor, deflections)}


@pytest.mark.parametrize(
    ("deflections", "passes"),
    [((0.55, 0.2), (True, True)), ((0.624, 0.251), (True, False)), ((0.63, 0.2), (False, True))],
)
def test_stop_gap_is_measured_on_the_solid_and_stands_a_fifth_above_the_deflection(sensor, deflections, passes):
    verdicts = stops(sensor, deflections)
    for name, gap, deflection, passed in zip(("low", "high"), (0.75, 0.3), deflections, passes, strict=True):
        stop = verdicts[f"stops_{name}"]
        assert (stop.value, stop.limit) == pytest.approx((gap, 1.2 * deflection), abs=KERNEL)
        assert stop.passed is passed


def blocked(sensor, gap):
    """Hang a bar over the upper low leaf at 0.6 of its length."""
    root, shuttle = sensor.housing.arms[0].roots
    x, z = root + 0.6 * (shuttle - root), sensor.housing.lower_leaf_level + 14.0 + 0.4 + gap
    bar = cq.Solid.makeBox(1.0, 6.0, sensor.housing.top_level - z, cq.Vector(x - 0.5, -3.0, z))
    return replace(sensor, part=replace(sensor.part, shape=sensor.part.shape.fuse(bar)))


@pytest.mark.parametrize(
    ("gap", "stop", "left"),
    [
        (0.1, 0.1 / MOVED, 0.1 - LEFT_AT_STOP),  # the leaf meets it before the shuttle is stopped
        (LEFT_AT_STOP + 0.05, 0.75, 0.05),  # it stays clear, but only just
        (0.0, None, None),  # it touches at rest
    ],
)
def test_bar_over_a_leaf_is_found(sensor, gap, stop, left):
    verdicts = stops(blocked(sensor, gap))
    assert verdicts["stops_low"].value == (None if stop is None else pytest.approx(stop, abs=KERNEL))
    assert verdicts["stops_low"].passed is (stop == 0.75)
    assert verdicts["deflected_gap_low"].value == (None if left is None else pytest.approx(left, abs=KERNEL))
    assert verdicts["deflected_gap_low"].passed is False
    assert verdicts["stops_high"].passed is True
    assert ("the leaf" in verdicts["stops_low"].reference) is (stop != 0.75)


def test_housing_without_a_stop_fails(sensor):
    above = cq.Solid.makeBox(200.0, 20.0, 20.0, cq.Vector(-100.0, -10.0, sensor.housing.cavity_level))
    verdict = stops(replace(sensor, part=replace(sensor.part, shape=sensor.part.shape.cut(above))))["stops_low"]
    assert (verdict.passed, verdict.value) == (False, None)
