"""The rise law of a design: that of the fruit that is told, and the readings of level presses that correct it."""

import numpy as np
import pytest
from measured_units import MeasuredDesign
from squares import BALL

from pipeline.reading.rise import design_curvatures, rise_law
from sensor.theory.contrast_rise import read_rise, select_rise
from solve.contact.pose_forces import Pose


@pytest.fixture(scope="module")
def designs():
    return [MeasuredDesign(BALL, assessed=False, **{"fruit.radius_mm": radius}) for radius in (35.0, 50.0)]


def test_a_radius_that_is_told_makes_the_law_of_that_ball(designs):
    """By the law of domes on the larger ball.

    Large strain is 1 % of h, and moves less. The body that S holds beside a half-space moves it by 1 % of its largest
    term, where the contacts move it by 7 %.
    """
    design = designs[0].design
    contrast, larger = (measured.report.read_out.contrast for measured in designs)
    told = rise_law(design, contrast, (1.0 / 50.0, 1.0 / 50.0))
    assert told.contrast.hertz == pytest.approx(larger.hertz, rel=5e-3)
    off_diagonal = ~np.eye(4, dtype=bool)
    assert np.array(told.contrast.S)[off_diagonal] == pytest.approx(np.array(larger.S)[off_diagonal], abs=4e-4)
    assert told.contrast.gaps == pytest.approx(larger.gaps)
    assert told.rolling.mean_curvature == pytest.approx(1.0 / 50.0)
    same = rise_law(design, contrast, design_curvatures(design))
    assert np.array(same.contrast.S) == pytest.approx(np.array(contrast.S))
    assert same.contrast.hertz == pytest.approx(contrast.hertz)


@pytest.mark.slow
def test_a_ball_that_is_told_has_no_saddle_of_the_design(designs):
    """Of a design on a turned ellipsoid: the gaps are those of a design on that ball."""
    fruit = {"fruit.shape": "ellipsoid", "fruit.radius_across_mm": 110.0, "fruit.azimuth_deg": 45.0}
    turned = MeasuredDesign(BALL, assessed=False, **fruit, **{"fruit.radius_mm": 47.0})
    told = rise_law(turned.design, turned.report.read_out.contrast, (1.0 / 50.0, 1.0 / 50.0))
    assert told.contrast.gaps == pytest.approx(designs[1].report.read_out.contrast.gaps, abs=1e-12)
    assert np.ptp(turned.report.read_out.contrast.gaps) > 0.05


def test_only_domes_on_a_square_and_a_round_fruit_roll(designs):
    design = designs[0].design
    contrast = designs[0].report.read_out.contrast
    assert rise_law(design, contrast).rolling is not None
    assert rise_law(design, contrast, (1e-9, 1e-9)).rolling is not None
    assert rise_law(design, contrast, (0.0, 0.0)).rolling is None


def test_level_presses_are_corrected_to_what_they_were_pressed_by(designs):
    """Of each design, at moduli between those of the table, by other samples of the press: these move E by 2e-4."""
    for measured in designs:
        read_out = measured.report.read_out
        assert [row.E_MPa for row in read_out.rise_level] == pytest.approx(np.geomspace(0.5, 3.5, 9).tolist())
        travels = np.linspace(0.0, measured.design.press.travel_mm, 25)[1:].tolist()
        for E in (0.6, 2.4):
            press = select_rise(measured.forces([Pose(E=E, travel=x) for x in travels]), 4)
            found = read_rise(rise_law(measured.design, read_out.contrast), press, np.zeros(4))
            logs = np.log([(row.read_MPa, row.E_MPa) for row in read_out.rise_level]).T
            assert np.exp(np.interp(np.log(found.E), *logs)) == pytest.approx(E, rel=4e-4)
