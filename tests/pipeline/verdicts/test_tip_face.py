"""Whether the face of a dome holds its contact."""

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from squares import GENTLE, gentle

from pipeline.verdicts.rules import tip_face_verdict
from sensor.design.tips import PressMotion

MODULI = np.array([0.5, 1.0, 3.5])
HIGH = np.array([0.4, 0.7, 1.98])  # [N] on the high tips at these
FORCES = np.stack([[0.15, 0.2, 0.3], HIGH, [0.15, 0.2, 0.3], HIGH], axis=1)
PRESS = SimpleNamespace(table=SimpleNamespace(E=MODULI, F=FORCES[:, None, :]))  # as much as the verdict reads


def test_reach_on_a_sphere_is_the_way_to_the_axis_and_the_radius_of_the_contact():
    found = tip_face_verdict(GENTLE, PRESS)
    R = 350.0 / 45.0
    run = 3.0 / 35.0 * R  # towards a side of the square that a printed dome ends in
    widest = ((0.75 * HIGH * R * 0.91 / MODULI) ** (1.0 / 3.0)).max()
    assert found.name == "geometry.tip_face"
    assert found.value == pytest.approx(run + widest, rel=1e-12)
    assert (found.limit, found.passed) == (2.7, True)
    pin = tip_face_verdict(gentle(socket="pin"), PRESS)
    assert pin.value - found.value == pytest.approx((math.sqrt(2.0) - 1.0) * run, rel=1e-12)


@pytest.mark.parametrize(
    ("design", "limit"),
    [(gentle(side_mm=4.0), 2.0), (replace(GENTLE, press=PressMotion(travel_mm=0.4, tilt_deg=8.0)), 2.7)],
    ids=["too narrow", "tilted off its contact"],
)
def test_face_that_does_not_hold_its_contact_fails(design, limit):
    found = tip_face_verdict(design, PRESS)
    assert (found.passed, found.limit) == (False, limit)
