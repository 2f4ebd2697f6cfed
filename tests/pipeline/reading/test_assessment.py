"""Readings of a square are exact where the law is; what is planted in them is found with its size."""

import dataclasses
import re

import numpy as np
import pytest
from square_stand_ins import (
    FORCE_ERROR,
    linear_pose_forces,
    square_contact,
    square_design,
    square_springs,
)

from cad.design.parameters import Design
from cad.design.tips import Tips
from cad.theory.contrast_law import ratio_modulus
from pipeline.reading import measurement
from pipeline.reading.analysis import error_analysis, lift_tilt, skin_pressures
from pipeline.reading.poses import Placement, occurring, radii, read_moduli
from pipeline.verdicts.rules import analysis_verdicts, skin_verdict

pytestmark = pytest.mark.usefixtures("linear_world")


def assessed(design=None):
    design = design or square_design()
    return error_analysis(sensor_of(design), design.reading)


def sensor_of(design):
    return measurement.pressed_sensor(design, square_contact(), square_springs())


def outcomes(found, design):
    return {verdict.name: verdict.passed for verdict in analysis_verdicts(found, design.reading)}


def test_no_pose_biases_a_square_of_whole_faces():
    design = square_design(tilt_deg=2.0)
    found = assessed(design)
    assert found.bias.value < 1e-9
    assert all(abs(row.bias) < 1e-9 for row in found.moduli)
    assert set(outcomes(found, design).values()) == {True}


def test_error_of_the_bias_is_that_of_the_forces_in_modulus():
    """Forces that are off by 0.1 % belong to a modulus that is off by more: the springs take a share of the travel."""
    found = assessed()
    springs, S = square_springs(), square_contact().S
    E = found.worst_bias.E
    F = np.linalg.solve(springs + S / E, np.full(4, 0.6))
    moved = np.linalg.solve(springs + S / (1.01 * E), np.full(4, 0.6))
    share = np.abs(np.log(moved / F)).max() / np.log(1.01)
    assert found.bias.error == pytest.approx(FORCE_ERROR / share, rel=0.01)


def judged_with_round_off(design, monkeypatch, seed):
    """Return the sentences on bias, uncertainty and bruise of forces that know how far a sensor leans, not whither."""
    random = np.random.default_rng(seed)

    def leaning(scene, contact, C, poses):
        level = [dataclasses.replace(pose, tilt_deg=(0.0, 0.0)) for pose in poses]
        made = linear_pose_forces(scene, contact, C, level)
        lean = np.array([np.hypot(*pose.tilt_deg) for pose in poses])[:, None]
        factors = (1.0 + 0.01 * lean * np.array([0.0, 1.0, 0.0, 1.0])) * (
            1.0 + 1e-12 * random.normal(size=made.F.shape)
        )
        return dataclasses.replace(made, F=made.F * factors, mean_pressure=made.mean_pressure * factors)

    monkeypatch.setattr(measurement, "pose_forces", leaning)
    sensor = sensor_of(design)
    found, pressures = error_analysis(sensor, design.reading), skin_pressures(sensor)
    bias, uncertainty, _ = analysis_verdicts(found, design.reading)
    worst = [row.worst for row in found.moduli] + [row.placement for row in pressures]
    return worst, [verdict.reference for verdict in (bias, uncertainty, skin_verdict(pressures))]


def test_worst_pose_of_ties_is_the_first_for_any_round_off(monkeypatch):
    design = square_design(tilt_deg=2.0)
    (worst, sentences), *others = [judged_with_round_off(design, monkeypatch, seed) for seed in range(5)]
    assert worst == [Placement(tilt_deg=(2.0, 0.0))] * 8
    assert all(other == (worst, sentences) for other in others)


def test_planted_misread_spring_fails_the_bias(monkeypatch):
    """Forces of high springs that are 11 % stiffer than the read-out knows."""
    design = square_design(bias_limit=0.02)

    def stiffer(scene, contact, C, poses):
        return linear_pose_forces(scene, contact, np.asarray(C) * np.array([1.0, 0.9, 1.0, 0.9])[:, None], poses)

    monkeypatch.setattr(measurement, "pose_forces", stiffer)
    found = assessed(design)
    assert found.bias.value > 0.02
    assert outcomes(found, design)["reading.bias"] is False


def test_level_readings_of_a_pair_off_the_middle_undo_what_its_line_makes_of_them():
    """Under the high tip the flesh gives 4 % more than under the low one: the line alone reads 3 to 6 % too soft."""
    design = Design(tips=Tips(offset_mm=2.0))
    S = np.array([[0.8, 0.04], [0.04, 0.83]])
    contact = dataclasses.replace(square_contact(), tips=design.tips.names, S=S, shape_change=np.zeros((2, 2)))
    C = np.diag([1.1, 0.05])
    sensor = measurement.pressed_sensor(design, contact, C)
    for E in (0.5, 1.3, 3.5):
        F = np.linalg.solve(C + S / E, [0.6, 0.6])
        by_line = ratio_modulus(C.tolist(), sensor.model.own_less_other, F.tolist())
        assert abs(by_line / E - 1.0) > 0.01
        assert sensor.model.modulus(np.array([F / 3, F / 2, F])) == pytest.approx(E, rel=1e-4)


def test_planted_noise_fails_the_uncertainty():
    design = square_design(noise_N=0.05)
    assert outcomes(assessed(design), design)["reading.uncertainty"] is False
    quiet = square_design(noise_percent=0.2)
    assert outcomes(assessed(quiet), quiet)["reading.uncertainty"] is True


def test_tilt_that_lifts_a_tip_is_refused_and_fails_the_lift():
    design = square_design(tilt_deg=8.0)
    found = assessed(design)
    assert found.bias.value < 1e-9
    assert re.match(r"\d+ of \d+ poses have no reading, as at 0.5 MPa, tilted 8 deg", found.refused)
    assert "is off the fruit" in found.refused
    assert set(outcomes(found, design).values()) == {False}
    bias, *_ = analysis_verdicts(found, design.reading)
    assert bias.reference.startswith(f"{found.refused}; of the others: largest |E read / E - 1|")


def test_poses_whose_contact_runs_off_the_face_have_no_reading_and_fail(monkeypatch):
    """Faces of domes too narrow for every tilted press; the level presses read as before."""
    design = square_design(tilt_deg=2.0, off_centre_mm=0.0, radius_spread=0.0)
    wide = 1.5 * design.tips.side_mm

    def off_face_where_tilted(scene, contact, C, poses):
        made = linear_pose_forces(scene, contact, C, poses)
        tilted = np.array([any(pose.tilt_deg) for pose in poses])
        return dataclasses.replace(
            made, F=np.where(tilted[:, None], np.nan, made.F), face_mm=np.where(tilted, wide, 0.0)
        )

    monkeypatch.setattr(measurement, "pose_forces", off_face_where_tilted)
    found = assessed(design)
    assert f"{wide:.3g} mm" in found.refused
    assert found.bias.value < 1e-9
    checked = outcomes(found, design)
    assert (checked["reading.bias"], checked["reading.uncertainty"]) == (False, False)


def hard(E_max):
    """Return the square on fruit up to a modulus [MPa] at which its springs take nearly all of the travel."""
    design = square_design()
    return dataclasses.replace(design, fruit=dataclasses.replace(design.fruit, E_max_MPa=E_max))


def test_forces_that_need_be_known_better_than_to_a_ten_thousandth_fail_bias_and_uncertainty():
    """At 1e6 MPa the fruit gives less than 1e-6 of the travel."""
    found = assessed(hard(1e6))
    assert (found.bias, found.uncertainty, found.moduli) == (None, None, ())
    assert found.refused
    checked = outcomes(found, hard(1e6))
    assert (checked["reading.bias"], checked["reading.uncertainty"]) == (False, False)


def test_level_press_without_a_reading_is_left_out_of_the_level_readings(monkeypatch):
    def off(scene, contact, C, poses):
        made = linear_pose_forces(scene, contact, C, poses)
        return dataclasses.replace(made, F=made.F * (1.0 + 1e-3 * np.array([-1.0, 1.0, -1.0, 1.0])))

    monkeypatch.setattr(measurement, "pose_forces", off)
    rows = measurement.level_readings(sensor_of(hard(1e6)))
    moduli = np.geomspace(0.5, 1e6, measurement.LEVEL_MODULI).tolist()
    assert [row.E_MPa for row in rows] == pytest.approx(moduli[: len(rows)])
    assert 1 <= len(rows) < len(moduli)


@pytest.mark.parametrize("shape", [{}, {"shape": "dome", "dome_radius_mm": 10.0}], ids=["flat", "dome"])
def test_lift_is_where_the_force_of_the_first_tip_ends(shape):
    """The softest spring lifts first, on the softest fruit, towards the corner: by the linear law, on a fine grid."""
    design = square_design()
    S, C = square_contact().S, square_springs()
    places = np.array(design.tips.places_mm)
    corner = places[0] / np.hypot(*places[0])

    def least(tilt, E):
        lowered = 0.6 + places @ (-np.tan(np.radians(tilt)) * corner)
        return np.linalg.solve(C + S / E, lowered).min()

    tilts = np.linspace(1.0, 15.0, 5601)
    expected = min(next(tilt for tilt in tilts if least(tilt, E) <= 0.0) for E in read_moduli(design.fruit))
    tips = dataclasses.replace(design.tips, **shape)  # domes are pressed at many tilts at once
    sensor = dataclasses.replace(sensor_of(design), design=dataclasses.replace(design, tips=tips))
    found = lift_tilt(sensor, design.reading)
    assert found.value <= expected * (1.0 + 2e-3)
    assert found.value + found.error >= expected * (1.0 - 2e-3)


def test_poses_are_at_least_those_that_the_issue_asks_for():
    design = square_design()
    places = list(occurring(design, design.reading))
    assert len(read_moduli(design.fruit)) >= 4
    tilted = {place.tilt_deg for place in places if not any(place.off_centre_mm)}
    assert len(tilted) == 17  # level, and eight directions at half and at the whole tilt
    tilt = (design.reading.tilt_deg, 0.0)
    off = design.reading.off_centre_mm
    beside = [place.off_centre_mm for place in places if place.tilt_deg == tilt and any(place.off_centre_mm)]
    assert beside == [(-off, 0.0), (off, 0.0)]  # against the tilt and with it
    ball = dataclasses.replace(design.fruit, shape="sphere", radius_mm=35.0, thickness_mm=12.0)
    assert radii(ball, design.reading) == (None, pytest.approx(28.0), pytest.approx(42.0))
