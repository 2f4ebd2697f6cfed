"""Verdicts on a cover and on the two plates of a square: their own pass, and what wrong ones are told."""

from dataclasses import replace

import cadquery as cq
import pytest
from squares import RESIN, square_sensor

from cad.checks.assembly_checks import cover_verdicts, plate_verdicts
from cad.parts.cover import RECESS_MM
from cad.parts.cover_solid import cover_part
from cad.parts.housing import SETBACK_MM
from cad.parts.housing_solid import housing_part, named_housing
from sensor.design.processes import PROCESSES

KERNEL = 1e-6


def by_name(verdicts):
    return {verdict.name.removeprefix("geometry."): verdict for verdict in verdicts}


def checked_cover(sensor, shape, process=PROCESSES["fdm-petg"]):
    return by_name(cover_verdicts(sensor, shape, process))


def checked_plates(sensor):
    return by_name(plate_verdicts(sensor))


def test_own_cover_passes_and_clearance_is_the_recess(sensor):
    verdicts = checked_cover(sensor, cover_part(sensor.housing).shape)
    assert all(verdict.passed for verdict in verdicts.values())
    assert verdicts["cover_clearance"].value == pytest.approx(min(RECESS_MM, SETBACK_MM), abs=1e-4)


def test_rim_that_a_shuttle_reaches_at_its_stop_fails(sensor):
    """A rib over the low shuttle, 0.2 mm above it at rest, lies beside it when it is at its stop 0.75 mm up."""
    housing = sensor.housing
    corner = cq.Vector(-5.0, 0.5 * housing.depth, housing.low_top_level + 0.2)
    ribbed = cover_part(sensor.housing).shape.fuse(cq.Solid.makeBox(2.0, RECESS_MM, 1.0, corner))
    verdict = checked_cover(sensor, ribbed)["cover_clearance"]
    assert (verdict.passed, verdict.value) == (False, pytest.approx(0.0, abs=KERNEL))
    assert "low arm" in verdict.reference


def test_cover_of_a_longer_housing_and_without_enough_recess_fails(sensor):
    """Half a turn is about the middle of the housing: the front cover is then off by as much, the other way."""
    longer = replace(sensor.housing, low=replace(sensor.housing.low, length=25.4))
    corner = cq.Vector(sensor.housing.left + 9.5, 0.5 * longer.depth + 0.2, longer.cover_level)
    filling = cq.Solid.makeBox(10.0, 1.0, 20.0, corner)
    verdicts = checked_cover(sensor, cover_part(longer).shape.fuse(filling))
    holes, clearance = verdicts["cover_holes"], verdicts["cover_clearance"]
    assert (holes.passed, holes.value) == (False, pytest.approx(0.4, abs=KERNEL))
    assert (clearance.passed, clearance.value) == (False, pytest.approx(0.2, abs=KERNEL))
    blank = cq.Solid.makeBox(1.0, 1.0, 1.0, cq.Vector(0.0, 10.0, 40.0))
    holes = checked_cover(sensor, blank)["cover_holes"]
    assert (holes.passed, holes.value) == (False, None)


def test_single_plate_has_no_verdict_on_two(sensor):
    assert plate_verdicts(sensor) == ()


def test_plates_of_a_square_pass_and_keep_twice_their_pads_apart(square):
    verdicts = checked_plates(square)
    covers = checked_cover(square, cover_part(square.housing).shape, RESIN)
    assert all(verdict.passed for verdict in (*verdicts.values(), *covers.values()))
    assert verdicts["plates"].value == pytest.approx(2.0 * square.housing.pad_height, abs=KERNEL)
    assert verdicts["plate_holes"].value == pytest.approx(0.0, abs=KERNEL)


@pytest.mark.parametrize(
    ("sizes", "depth", "value", "reason"),
    [
        ({}, 6.5, None, "run into each other"),  # their frames overlap by half a millimetre, whatever their pads
        pytest.param(
            {"pad_height": 0.0, "spacing": 5.6, "shuttle_width": 5.3, "tip_side": 5.3},
            None,
            0.0,
            "meet at their pads",
            marks=pytest.mark.slow,
        ),
        ({"pad_height": 0.1}, None, None, "do not meet: screws would bend the plates by 0.2 mm"),
    ],
)
def test_plates_that_do_not_fit_fail(square, sizes, depth, value, reason):
    housing = replace(square.housing, **sizes)
    if depth:
        housing = replace(housing, low=replace(housing.low, depth=depth), high=replace(housing.high, depth=depth))
    verdict = checked_plates(square_sensor(housing))["plates"]
    assert (verdict.passed, verdict.value) == (False, None if value is None else pytest.approx(value, abs=KERNEL))
    assert reason in verdict.reference


def test_shuttle_that_stands_out_of_its_plate_fails(square):
    """A rib on the back of the low shuttle leaves 0.1 mm to the other plate."""
    housing = square.housing
    corner = cq.Vector(-0.5 * housing.spacing - 1.0, 0.5 * housing.depth, 0.5 * housing.top_level)
    rib = cq.Solid.makeBox(2.0, 0.3, 2.0, corner)
    ribbed = replace(square, part=replace(square.part, shape=square.part.shape.fuse(rib)))
    verdict = checked_plates(ribbed)["plates"]
    assert (verdict.passed, verdict.value) == (False, pytest.approx(0.1, abs=KERNEL))


def test_missing_and_misplaced_dowel_holes_fail(square):
    """One of the two holes is drilled 0.1 mm farther out: its partner comes to stand as far on the other side."""
    blank = replace(square.housing, dowel_hole=0.0)
    plate = housing_part(blank)
    verdict = checked_plates(replace(square, part=plate))["plate_holes"]
    assert (verdict.passed, verdict.value) == (False, None)
    (x, z), (other_x, _) = square.housing.dowels
    drill = cq.Workplane("XZ", origin=(0.0, 10.0, 0.0)).pushPoints([(x - 0.1, z), (other_x, z)])
    holes = drill.circle(0.5 * square.housing.dowel_hole).extrude(20.0).findSolid()
    misplaced = named_housing(plate.shape.cut(holes), blank)
    verdict = checked_plates(replace(square, part=misplaced))["plate_holes"]
    assert (verdict.passed, verdict.value) == (False, pytest.approx(0.1, abs=KERNEL))
