"""A sensor solves what it is asked for; on sized springs it knows what a run finds."""

import pytest
from stand_ins import CONTACT

from pipeline import sensor as module
from pipeline.options import RunOptions, load_design
from pipeline.sensor import Sensor
from sensor.design.parameters import Design
from sensor.quantity import InputError

BIAS = 0.001
"""Left of a bias between model and run: leaves of the beam law are 2 % off the fitted ones, which is 2 % of what the
sideways compliance makes of the bias, up to 0.022 of these designs."""


@pytest.mark.slow
@pytest.mark.parametrize(("name", "tolerance"), [("kiwi", 0.02), pytest.param("mango", 0.01, marks=pytest.mark.study)])
def test_bias_of_small_domes_is_that_of_fitted_springs(name, tolerance):
    """Without the sideways compliance the bias of `kiwi` is 0.022 too low. Both have one contact, however rough."""
    design = load_design(name)
    options = RunOptions(tolerance=tolerance)
    fitted = Sensor(design=design, options=options).readings
    sized = Sensor(design=design, options=options, springs_as="sized").readings
    for of_model, of_run in zip(sized.moduli, fitted.moduli, strict=True):
        assert abs(of_model.bias.value) == pytest.approx(abs(of_run.bias.value), abs=BIAS)
        assert of_model.sources.total == pytest.approx(of_run.sources.total, rel=0.01)


def test_springs_lean_where_a_stage_feels_it():
    sensor = Sensor(design=load_design("mango"), options=RunOptions(tolerance=0.02), springs_as="sized")
    assert sensor.level.P_max > 1.0
    assert "springs" not in vars(sensor)  # whose sideways give is solved by finite elements
    assert sensor.upright_springs.sideways is None
    assert sensor.springs.sideways is not None


UNSOLVABLE = load_design("mango", {"reading.tilt_deg": 15.0, "reading.radius_mm": [22.0, 30.0]})


def test_scene_that_cannot_be_pressed_is_refused_before_a_solve(monkeypatch):
    """Sized springs may be asked for in such a scene, as they need no press."""
    with pytest.raises(InputError, match=r"reading\.tilt_deg"):
        Sensor(design=UNSOLVABLE)
    sized = Sensor(design=UNSOLVABLE, springs_as="sized")
    with monkeypatch.context() as patch:
        patch.setattr(module, "scene_compliance", lambda *_: pytest.fail("solved"))
        for stage in ("press", "readings", "verdicts"):
            with pytest.raises(InputError, match=r"reading\.tilt_deg"):
                sized.solve(stage)
    assert sized.sizing.springs.K_l == pytest.approx(1e-3 * UNSOLVABLE.springs.K_l_N_per_m)


def test_search_gives_contact_and_height_offsets(monkeypatch):
    """Neither is solved or taken as level again: P depends on both."""
    monkeypatch.setattr(module, "scene_compliance", lambda *_: pytest.fail("solved"))
    offsets = (0.0, -0.02)
    level, stepped = (
        Sensor(design=Design(), springs_as="sized", known_contact=CONTACT, known_offsets_mm=known)
        for known in ((), offsets)
    )
    assert (level.is_level, stepped.is_level) == (True, False)
    assert stepped.pressed.height_offsets == stepped.upright.height_offsets == offsets
    P = [sensor.press.at_largest_E.P[-1, -1] for sensor in (level, stepped)]
    assert P[1] < P[0]  # the high tip touches later
    assert level.reached.P_max.value == pytest.approx(P[0])
    assert stepped.reached.P_max.value == pytest.approx(P[1])
