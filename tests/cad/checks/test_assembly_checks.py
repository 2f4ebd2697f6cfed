"""Verdicts on a cover and on the two plates of a square: their own pass, and what wrong ones are told."""

from dataclasses import replace

import cadquery as cq
import pytest
from squares import RESIN, square_sensor

from cad.checks.assembly_checks import cover_verdicts, plate_verdicts
from cad.parts.cover import RECESS_MM
from cad.parts.cover_solid import cover_part
from cad.parts.housing import SETBACK_MM, BackToBack
from sensor.design.processes import PROCESSES

KERNEL = 1e-6
LOW_PADS = {"back_to_back": BackToBack(pad_height=0.1, dowel_hole=2.95)}


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


def test_cover_without_enough_recess_fails(sensor):
    """A filling on the inner face of the recess leaves 0.2 mm beside the leaves, on the front as on the back."""
    housing = sensor.housing
    corner = cq.Vector(housing.left + 9.5, 0.5 * housing.depth + 0.2, housing.cover_level)
    filling = cq.Solid.makeBox(10.0, 1.0, 20.0, corner)
    verdict = checked_cover(sensor, cover_part(housing).shape.fuse(filling))["cover_clearance"]
    assert (verdict.passed, verdict.value) == (False, pytest.approx(0.2, abs=KERNEL))


def test_single_plate_has_no_verdict_on_two(sensor):
    assert plate_verdicts(sensor) == ()


def test_plates_of_a_square_pass_and_keep_twice_their_pads_apart(square):
    verdicts = checked_plates(square)
    covers = checked_cover(square, cover_part(square.housing).shape, RESIN)
    assert all(verdict.passed for verdict in (*verdicts.values(), *covers.values()))
    assert verdicts["plates"].value == pytest.approx(square.housing.back_to_back.gap, abs=KERNEL)


@pytest.mark.parametrize(
    ("sizes", "depth", "value", "reason"),
    [
        ({}, 6.5, None, "the plates intersect"),  # their frames overlap by half a millimetre, whatever their pads
        pytest.param(
            {**LOW_PADS, "spacing": 5.8, "shuttle_width": 5.5, "tip_side": 5.5},
            None,
            0.2,
            "the pads of the plates touch",
            marks=pytest.mark.slow,
        ),
        (LOW_PADS, None, None, "do not touch: screws would bend the plates by 0.2 mm"),
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
