import math
from dataclasses import replace

import cadquery as cq
import pytest

from cad.checks.clearance import clearance_verdicts, stop_verdicts
from cad.design.fruit import Fruit
from cad.design.tips import Press
from cad.parts.housing_solid import housing_part

KERNEL = 1e-6


def named(findings, name):
    (finding,) = (each for each in findings if each.name == f"geometry.{name}")
    return finding


def stops(sensor, deflections):
    findings = stop_verdicts(sensor, deflections)
    return named(findings, "stops_low"), named(findings, "stops_high")


def with_housing(sensor, **changes):
    housing = replace(sensor.housing, **changes)
    return replace(sensor, housing=housing, part=housing_part(housing))


def lowest_corner(housing, tilt):
    """Drop of the lowest bottom corner of the frame when the sensor tilts one of the 16 ways."""
    corners = [(x, y) for x in (housing.left, housing.right) for y in (-0.5 * housing.depth, 0.5 * housing.depth)]
    ways = [math.radians(22.5 * step) for step in range(16)]
    reach = max(x * math.cos(way) + y * math.sin(way) for x, y in corners for way in ways)
    return housing.protrusion * math.cos(tilt) - reach * math.sin(tilt)


@pytest.mark.parametrize(("protrusion", "passes"), [(3.4, True), (2.4, False)])
def test_frame_over_a_large_fruit_is_as_near_as_its_lowest_corner(sensor, protrusion, passes):
    large = with_housing(replace(sensor, fruit=Fruit(length_mm=200.0, width_mm=200.0)), protrusion=protrusion)
    expected = lowest_corner(large.housing, math.radians(3.0)) - 0.6
    finding = named(clearance_verdicts(large), "frame_clearance")
    assert finding.value == pytest.approx(expected, abs=KERNEL)
    assert finding.passed is passes
    assert (expected > 0.0) is passes


def test_more_tilt_of_the_press_counts(sensor):
    large = with_housing(replace(sensor, fruit=Fruit(length_mm=200.0, width_mm=200.0)), protrusion=3.4)
    tilted = replace(large, press=Press(tilt_deg=-8.0))
    assert named(clearance_verdicts(large), "frame_clearance").passed is True
    assert named(clearance_verdicts(tilted), "frame_clearance").passed is False


def test_frame_beside_a_small_fruit_is_as_far_as_its_side(sensor):
    """The right wall is at x = 20, the fruit ends at 10: the fall of 3 degrees turns it by little."""
    wall = sensor.housing.arms[1].wall
    value = named(clearance_verdicts(sensor), "frame_clearance").value
    assert wall - 10.0 - 1.0 < value < wall - 10.0 + 0.1


@pytest.mark.parametrize(("travel", "passes"), [(0.6, True), (0.99, True), (1.01, False)])
def test_neck_stands_over_the_fruit_by_tip_height_less_travel(sensor, travel, passes):
    finding = named(clearance_verdicts(replace(sensor, press=Press(travel_mm=travel))), "neck_clearance")
    assert finding.value == pytest.approx(1.0 - travel, abs=KERNEL)
    assert finding.passed is passes


def test_stop_gap_is_measured_on_the_solid(sensor):
    low, high = stops(sensor, (0.55, 0.2))
    assert (low.value, high.value) == pytest.approx((22.75 - 22.0, 22.75 - 22.45), abs=KERNEL)
    assert (low.limit, high.limit) == pytest.approx((1.2 * 0.55, 1.2 * 0.2))
    assert low.passed
    assert high.passed


def test_deflection_up_to_the_stop_fails(sensor):
    low, high = stops(sensor, (0.65, 0.26))
    assert (low.passed, high.passed) == (False, False)


def blocked(sensor, gap):
    """Hang a bar over the upper low leaf at 0.6 of its length, where a guided leaf moves 0.648 of its end."""
    root, shuttle = sensor.housing.arms[0].roots
    x, z = root + 0.6 * (shuttle - root), sensor.housing.lower_leaf_level + 14.0 + 0.4 + gap
    bar = cq.Solid.makeBox(1.0, 6.0, sensor.housing.top_level - z, cq.Vector(x - 0.5, -3.0, z))
    return replace(sensor, part=replace(sensor.part, shape=sensor.part.shape.fuse(bar)))


def test_leaf_that_meets_the_frame_before_the_shuttle_is_found(sensor):
    moved = 3.0 * 0.6**2 - 2.0 * 0.6**3
    low, high = stops(blocked(sensor, 0.1), (0.55, 0.2))
    assert low.value == pytest.approx(0.1 / moved, abs=KERNEL)
    assert "leaf touches first" in low.reference
    assert (low.passed, high.passed) == (False, True)
    left = named(stop_verdicts(blocked(sensor, 0.1), (0.55, 0.2)), "deflected_gap_low")
    assert left.value == pytest.approx(0.1 - 0.75 * moved, abs=KERNEL)
    assert left.passed is False


def test_leaf_that_stays_clear_only_just_at_the_stop_fails(sensor):
    moved = 3.0 * 0.6**2 - 2.0 * 0.6**3
    findings = stop_verdicts(blocked(sensor, 0.75 * moved + 0.05), (0.55, 0.2))
    assert named(findings, "stops_low").passed is True
    assert named(findings, "deflected_gap_low").value == pytest.approx(0.05, abs=KERNEL)
    assert named(findings, "deflected_gap_low").passed is False


def test_leaf_that_touches_its_stop_fails(sensor):
    low, high = stops(blocked(sensor, 0.0), (0.55, 0.2))
    assert (low.passed, low.value, high.passed) == (False, None, True)
    assert low.reference == "no stop: the leaf touches it already, or nothing is above"


def test_housing_without_a_stop_fails(sensor):
    low, _ = stops(replace(sensor, part=replace(sensor.part, shape=_without_bar(sensor))), (0.55, 0.2))
    assert (low.passed, low.value) == (False, None)


def _without_bar(sensor):
    cut = cq.Solid.makeBox(200.0, 20.0, 20.0, cq.Vector(-100.0, -10.0, sensor.housing.cavity_level))
    return sensor.part.shape.cut(cut)
