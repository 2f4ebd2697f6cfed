"""Whether the face of a dome holds its contact."""

import math
from dataclasses import replace

import numpy as np
import pytest
from squares import GENTLE, gentle
from stand_ins import CONTACT, springs_of

from pipeline.response.scene_press import press_scene, scene_of
from pipeline.verdicts.rules import tip_face_verdict
from sensor.design.parameters import Design
from sensor.design.tips import PressMotion

HIGH_FORCE = 1.98  # [N] on a high tip of the gentle square at E 3.5 MPa


@pytest.fixture(scope="module")
def press():
    """Return a press of four tips: forces at full travel at three moduli, whatever they come from."""
    design = Design()
    found = press_scene(scene_of(design), CONTACT, springs_of(design).C)
    forces = np.array([[0.15, 0.4, 0.15, 0.4], [0.2, 0.7, 0.2, 0.7], [0.3, HIGH_FORCE, 0.3, HIGH_FORCE]])
    table = replace(found.table, E=np.array([0.5, 1.0, 3.5]), F=forces[:, None, :])
    return replace(found, table=table)


def test_reach_on_a_sphere_is_the_way_to_the_axis_and_the_radius_of_the_contact(press):
    found = tip_face_verdict(GENTLE, press)
    R = 350.0 / 45.0
    run = 3.0 / 35.0 * R  # towards a side of the square that a printed dome ends in
    widest = max(
        (0.75 * force * R * 0.91 / E) ** (1.0 / 3.0)
        for E, force in zip((0.5, 1.0, 3.5), (0.4, 0.7, HIGH_FORCE), strict=True)
    )
    assert found.name == "geometry.tip_face"
    assert found.value == pytest.approx(run + widest, rel=1e-12)
    assert (found.limit, found.passed) == (2.7, True)
    pin = tip_face_verdict(gentle(socket="pin"), press)
    assert pin.value - found.value == pytest.approx((math.sqrt(2.0) - 1.0) * run, rel=1e-12)


def test_face_that_is_too_narrow_fails_and_so_does_one_that_is_tilted_off_its_contact(press):
    narrow = tip_face_verdict(gentle(side_mm=4.0), press)
    assert (narrow.passed, narrow.limit) == (False, 2.0)
    tilted = tip_face_verdict(replace(GENTLE, press=PressMotion(travel_mm=0.4, tilt_deg=8.0)), press)
    assert tilted.passed is False
