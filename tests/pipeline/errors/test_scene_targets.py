"""P_max and NL of the scene that was asked for, and what would make it pass: by the balance of springs and fruit."""

import dataclasses
import math

import numpy as np
import pytest
from stand_ins import CONTACT, draw_sensor, sizing_of, springs_of

from pipeline.errors.targets import evaluate_targets
from pipeline.response.scene_press import press_scene, scene_of
from pipeline.verdicts.rules import NL_verdict, P_max_verdict
from sensor.design.parameters import Design, Targets
from sensor.design.tips import PressMotion

SPRINGS = sizing_of(Design()).springs
C = np.diag([1.0 / K for K in SPRINGS.stiffnesses])
TILTED = Design(press=PressMotion(tilt_deg=1.0))
STEP = 4.0 * math.tan(math.radians(1.0))


def checked(design, height_offsets=()):
    """Return what a scene of springs of the design's targets reaches, and the verdicts on P_max and NL."""
    springs = springs_of(design)
    press = press_scene(scene_of(design, height_offsets), CONTACT, springs.C)
    reached = evaluate_targets(draw_sensor(design, springs), design.targets, press)
    return reached, P_max_verdict(reached.P_max, design.targets, ""), NL_verdict(reached.NL, design.targets, "")


def balance(E, travels):
    """Return P of flat tips at their own travels [mm] on fruit of modulus E [MPa]."""
    forces = np.linalg.solve(C * E + CONTACT.S, travels)
    return forces[1] / forces[0]


def test_tilted_sensor_is_judged_by_what_it_reads():
    """At 1 deg all faces touch whole at full travel: the balance with travels of 0.6 -+ 4 mm tan(1 deg)."""
    _, P_max, NL = checked(TILTED)
    travels = (0.6 - STEP, 0.6 + STEP)
    assert P_max.passed is False
    assert P_max.value == pytest.approx(balance(3.5, travels), abs=P_max.error)
    softest, middle, top = (balance(E, travels) for E in (0.0, 1.75, 3.5))
    assert NL.value == pytest.approx((middle - softest) / (top - softest) - 0.5, abs=NL.error)


def test_flat_level_scene_is_the_two_spring_law():
    reached, *_ = checked(Design())
    level = reached.level
    of_scene = (reached.P_max.value, reached.P_max.error, reached.NL.value, reached.NL.error)
    assert of_scene == (level.P_max, level.P_max_error, level.NL, level.NL_error)
    assert reached.P_max.value == pytest.approx(5.0, rel=1e-9)


@pytest.mark.slow
def test_largest_departure_is_at_least_that_of_mid_range():
    largest, middle = (
        checked(dataclasses.replace(TILTED, targets=Targets(NL_definition=definition)))[0].NL.value
        for definition in ("largest", "mid-range")
    )
    assert middle < largest < 1.02 * middle


def test_tip_that_hangs_lower_by_its_weight_is_ahead_in_the_scene():
    """0.019 mm of the low tip: the balance with the high one as much behind."""
    reached, *_ = checked(Design(), (0.0, -0.019))
    assert reached.P_max.value == pytest.approx(balance(3.5, (0.6, 0.581)), rel=1e-9)


def test_tip_off_the_fruit_leaves_no_ratio():
    _, P_max, _ = checked(Design(press=PressMotion(travel_mm=0.3, tilt_deg=5.0)))
    assert (P_max.value, P_max.passed) == (None, False)
