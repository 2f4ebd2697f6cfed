"""What the form of domes does to a design, and what a reference ball leaves of it."""

import math
from dataclasses import replace

import numpy as np
import pytest
from flat_square import square_design
from refusal import refusal
from squares import GENTLE

from cad.parts.dome_form import CAPS
from pipeline.options import load_design
from pipeline.reading.form import form_error_changes, interpolate_to_middle
from pipeline.reading.measurement import RiseModel
from pipeline.reading.rise import rolling_domes
from pipeline.reading.uncertainty import SlopesOnBall, designed_channels
from pipeline.sensor import Sensor
from sensor.design.reading import PRESS_S, ReadingRequirements
from sensor.quantity import UNIFORM_DEVIATION
from sensor.theory.contrast_law import contrast_weights
from sensor.theory.creep import CreepLaw

# As of level domes with springs of 0.15 and 1.4 N/mm on flesh of 2 MPa, whose low tips carry a sixth of the high ones.
PRESS = np.linspace(0.1, 1.0, 16)[:, None] ** 1.3 * np.array([0.04, 0.26, 0.04, 0.26])
WEIGHTS = contrast_weights(GENTLE.tips.places_mm, GENTLE.tips.springs)
DOMES = rolling_domes(GENTLE, WEIGHTS)
MODEL = RiseModel(law=DOMES.law(np.diag([1.0 / 0.15, 1.0 / 1.4] * 2).tolist()))
SMALL = 1e-3


def test_radius_is_off_as_far_as_the_rim_of_its_face():
    """Read by the law of domes of another radius: half of 0.05 mm at the rim, whose height is that of a sphere."""
    radius, half = DOMES.dome_radius, 0.5 * GENTLE.tips.side_mm
    rim = radius - math.sqrt(radius**2 - half**2)
    rounder = replace(DOMES, dome_radius=radius * (1.0 + SMALL)).law(MODEL.law.contrast.C)
    # A reading moves against its law: domes that are flatter than the law has them read too large.
    slope = -math.log(RiseModel(law=rounder).read_modulus(PRESS) / MODEL.read_modulus(PRESS)) / SMALL
    found = form_error_changes(GENTLE, MODEL, PRESS)
    assert len(found) == 1 + len(CAPS)
    assert found[0] == pytest.approx(0.025 / rim * slope, rel=0.02)


def test_ground_tips_are_off_by_less_and_flat_ones_have_no_form():
    """As pins of 0.01 mm against a print of 0.05 mm."""
    pins = replace(GENTLE, tips=replace(GENTLE.tips, socket="pin"))
    ratio = form_error_changes(pins, MODEL, PRESS) / form_error_changes(GENTLE, MODEL, PRESS)
    assert ratio == pytest.approx(np.full(1 + len(CAPS), 0.2))
    assert form_error_changes(square_design(), MODEL, PRESS).size == 0


def test_middle_of_moduli_is_that_of_their_logarithms():
    rows = np.array([[1.0, 2.0], [3.0, 6.0], [5.0, 10.0]])
    assert interpolate_to_middle([1.0, 2.0, 4.0], rows) == pytest.approx([3.0, 6.0])
    assert interpolate_to_middle([1.0, 4.0], rows[:2]) == pytest.approx([2.0, 4.0])


@pytest.mark.parametrize(
    ("by", "decades"), [("plate", math.log10(30.0 * math.exp(0.5) / PRESS_S)), ("weights", 1.217), ("ball", 0.0)]
)
def test_creep_is_that_since_the_calibration(by, decades):
    """Of presses on a ball, which last as long, only the time within a press is left."""
    law = CreepLaw(0.025, 0.01)
    found = designed_channels(ReadingRequirements(calibrated_by=by), np.ones(4), None, law).creep
    assert found == pytest.approx(math.hypot(decades * 0.01 / 1.025, UNIFORM_DEVIATION * law.exponent), rel=1e-3)


def test_a_ball_takes_out_what_moves_its_own_reading():
    channels = designed_channels(
        ReadingRequirements(calibrated_by="ball", stiffness_percent=1.0, gain_percent=2.0), np.ones(2), None
    )
    springs, gains = np.array([0.5, -1.0]), np.array([1.0, 3.0])
    shown = SlopesOnBall(springs=0.8 * springs, gains=0.9 * gains)
    left = replace(channels, on_ball=shown).spring_and_gain_uncertainty(springs, gains)
    assert left["stiffness"] == pytest.approx(0.01 * np.linalg.norm(0.2 * springs + 0.1 * gains))
    assert left["gain"] == pytest.approx(0.02 * np.linalg.norm(0.1 * gains))


@pytest.mark.parametrize(
    ("name", "settings"), [("paper-on-mango", {}), ("mango", {"fruit.skin_mm": 0.3, "fruit.skin_E_MPa": 10.0})]
)
def test_a_ball_is_refused_where_it_shows_nothing(name, settings):
    assert refusal(load_design, name, {**settings, "reading.calibrated_by": "ball"}).field == "reading.calibrated_by"


@pytest.mark.parametrize(
    ("by", "accuracy", "passes"),
    [
        ("plate", None, False),
        ("ball", None, True),
        pytest.param("ball", 0.15, False, marks=pytest.mark.slow),
        pytest.param("plate", 0.01, True, marks=pytest.mark.slow),
    ],
)
def test_form_of_domes_decides_the_verdict_of_mango(by, accuracy, passes):
    """A process that prints three times as badly fails also after a ball, one as good as ground steel needs none."""
    design = load_design("mango", {"reading.calibrated_by": by})
    if accuracy is not None:
        printer = replace(design.process, name="other", accuracy_mm=accuracy)
        design = replace(design, print=replace(design.print, process="other"), printer=printer)
    readings = Sensor(design=design, springs_as="sized").readings
    assert all(row.over_limit <= 1.0 for row in readings.moduli) == passes
    for row in readings.moduli:
        assert ("ball" in row.sources.contributions) == (by == "ball")
        assert len(row.form) == 1 + len(CAPS)
    if by == "plate":
        for row in readings.moduli:
            assert row.sources.contributions["dome_form"] == pytest.approx(math.hypot(*row.form), rel=0.01)
