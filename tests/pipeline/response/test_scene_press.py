"""Each press of a scene is solved once, by the stage that owns it; the closed forms of its forces."""

import importlib

import numpy as np
import pytest
from stand_ins import CONTACT, result_of, springs_of

import pipeline.response.scene_press
from pipeline.response.scene_press import TRAVELS, mean_tip_pressure, press_scene, scene_of, spring_fractions
from sensor.design.fruit import Fruit
from sensor.design.parameters import Design
from sensor.design.tips import PressMotion, Tips
from sensor.quantity import InputError
from solve.contact.scene import check_scene

TILTED = PressMotion(tilt_deg=1.0)
NEAR_A_SIDE = r"^gap from tip to side face = 0.9 mm must be at least one side"


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"press": PressMotion(tilt_deg=25.0)}, r"^press.tilt_deg = 25 deg must be such that no tip meets"),
        ({"press": TILTED, "tips": Tips(offset_mm=4.6)}, NEAR_A_SIDE),
    ],
)
def test_scene_that_contact_cannot_solve_is_refused_before_anything_is_solved(change, message, monkeypatch):
    monkeypatch.setattr(
        importlib.import_module("pipeline.sensor"), "fruit_compliance", lambda *_: pytest.fail("the fruit was solved")
    )
    with pytest.raises(InputError, match=message):
        pipeline.run(Design(**change))


@pytest.mark.parametrize(("tilt", "presses"), [(10.0, 2), (19.5, 0), (-19.5, 0)])
def test_spread_of_the_tilt_that_contact_cannot_solve_is_left_out(tilt, presses, monkeypatch):
    """At 20 deg the slopes are no longer small; a press at 19.5 deg is solved, only not one degree steeper."""
    monkeypatch.setattr(pipeline.response.scene_press, "scene_response", lambda scene, *_: check_scene(scene))
    design = Design(press=PressMotion(tilt_deg=tilt, tilt_spread_deg=1.0))
    assert len(press_scene(scene_of(design), CONTACT, np.eye(2)).tilted) == presses


def test_presses_end_where_the_design_says():
    """The table at full travel and each modulus shown, the scan at E_max, the hardest at the largest of all."""
    design = Design(fruit=Fruit(E_MPa=(1.0, 10.0), E_max_MPa=3.5))
    press = press_scene(scene_of(design), CONTACT, springs_of(design).C)
    assert press.table.E.tolist() == [1.0, 10.0]
    assert (len(press.table.x), press.table.x[-1]) == (TRAVELS, design.press.travel_mm)
    assert (press.scan.E[0], press.scan.E[-1]) == (1.0, 3.5)
    assert (np.diff(press.scan.E) > 0.0).all()
    curve = press.curve
    assert (curve.E[-1], curve.x[-1], curve.P.shape) == (3.5, design.press.travel_mm, (73, 6))
    assert curve.E[36] == 0.5 * 3.5
    assert (press.at_largest_E.E.tolist(), press.at_largest_E.x.tolist()) == ([10.0], [design.press.travel_mm])


def test_share_of_a_spring_is_its_share_of_the_compliance():
    """F = x / (1/K + 1/K_m): dF/F = dK/K x (1/K) / (1/K + 1/K_m), with 1/K_m = (s11 - s12) / E."""
    C = np.diag([1.0 / 0.9, 1.0 / 20.0])
    shares = spring_fractions(CONTACT, C, 2.0)
    soft_fruit = (0.766603 - 0.010526) / 2.0
    assert shares == pytest.approx([(1.0 / K) / (1.0 / K + soft_fruit) for K in (0.9, 20.0)], rel=1e-12)


def test_mean_pressure_is_the_larger_force_over_the_face_of_its_tip():
    """2.24 N of the high tip on 1 mm^2 at 3.5 MPa and full travel."""
    result = result_of()
    force = result.press.table.F[-1, -1].max()
    assert mean_tip_pressure(result.design, result.press) == pytest.approx(force / 1.0, rel=1e-12)
    assert force == pytest.approx(2.24, abs=0.01)
