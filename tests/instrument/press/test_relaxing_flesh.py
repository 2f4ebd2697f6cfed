"""Presses of flesh that relaxes, read back as the modulus at the first instant and how far it relaxed."""

import dataclasses
from dataclasses import replace

import numpy as np
import pytest
from firmware_presses import BALL as BALL_OF_A_UNIT
from measured_units import MeasuredDesign, readings_at
from squares import BALL

from instrument.press.hold import LATE_FRACTION
from pipeline.reading.reading_over_time import reading_over_time
from pipeline.response.scene_press import scene_of
from sensor.theory.contrast_law import ContrastLaw
from sensor.theory.relaxation import Relaxation
from solve.contact.domes.fruit_under_domes import fruit_under_domes
from solve.contact.domes.geometry import dome_poses
from solve.contact.domes.law import dome_forces
from solve.contact.relaxing import timed_forces
from twintip.cli import main

ARMS = ((0.25, 0.8), (0.2, 30.0))
TIME = {
    "fruit.relaxation": [list(arm) for arm in ARMS],
    "press.speed_mm_per_s": 0.5,
    "press.hold_s": 3.0,
}
STEP_S = 0.02


@pytest.fixture(scope="module")
def square():
    return MeasuredDesign(BALL, assessed=False, **TIME, **{"reading.at_s": 2.0})


@pytest.fixture(scope="module")
def pair():
    return MeasuredDesign("paper", **TIME)


def times_of(design, until=1.1):
    return np.arange(0.0, design.stop_s + until * design.press.hold_s, STEP_S)


def dome_press(square, E, times, **fruit):
    """Return the forces [N] of domes over time by the whole law of domes, one elastic press for each step.

    `fruit` is what the fruit has other than that of the design.

    Maxwell's arms are stepped by the trapezoidal rule: m' = (n - m) / tau.
    """
    design = dataclasses.replace(square.design, fruit=dataclasses.replace(square.design.fruit, **fruit))
    scene = scene_of(design, (), square.sideways)
    body = fruit_under_domes(scene, square.contact, [design.fruit])
    shares, taus = np.array(ARMS).T[..., None]
    elastic = np.zeros(len(square.K))
    memory = np.zeros((len(ARMS), len(elastic)))
    rows = [elastic]
    for step, t in zip(np.diff(times), times[1:], strict=True):
        old = 0.5 * step / taus
        kept = (memory * (1.0 - old) + old * elastic) / (1.0 + old)
        fresh = 1.0 - float((shares * old / (1.0 + old)).sum())
        lost = (shares * kept).sum(axis=0)
        travel = np.array([design.press.travel_mm * min(t / design.stop_s, 1.0)])
        level = dome_poses([scene], travel)
        lowered = dataclasses.replace(level, centres=level.centres - (square.C @ lost)[None, :, None] * [0.0, 0.0, 1.0])
        answer = dome_forces(lowered, np.array([fresh * E]), square.C, body).F[0]
        elastic = answer / fresh
        memory = kept + old / (1.0 + old) * elastic
        rows.append(answer - np.where(answer > 0.0, lost, 0.0))
    return np.array(rows)


def pair_press(pair, E, times, lead=0.0, arms=ARMS):
    law = ContrastLaw(weights=(-1.0, 1.0), gaps=(0.0, lead), C=pair.C, S=pair.contact.S)
    travel = pair.design.press.travel_mm * np.minimum(times / pair.design.stop_s, 1.0)
    return timed_forces(law, Relaxation(arms), np.array([E]), times[None], travel[None]).F[0]


def read_log(sensor, times, forces):
    (reading,) = readings_at(sensor, times, forces)
    return reading


@pytest.mark.parametrize("E", [0.6, *(pytest.param(E, marks=pytest.mark.study) for E in (1.4, 3.0))])
def test_square_of_domes_reads_the_first_instant(square, E):
    """The forces are those of the whole law of domes: what the contrast leaves out of it is in the bar."""
    times = times_of(square.design)
    forces = dome_press(square, E, times)
    reading = read_log(square.measuring(), times, forces)
    assert pytest.approx(E, rel=5e-3) == reading.E
    assert abs(reading.E / E - 1.0) <= reading.u
    late = reading.others["apparent"]
    assert 0.6 * E < late < 0.9 * E
    assert 0.7 < reading.relaxation < 0.9
    assert reading.flags == ()


def test_a_ball_corrects_both_moduli(square):
    times = times_of(square.design)
    forces = dome_press(square, 1.0, times)
    plain = square.measuring()
    corrected = replace(plain, unit=replace(plain.unit, ball=replace(BALL_OF_A_UNIT, factor=1.1)))
    expected, reading = (read_log(sensor, times, forces) for sensor in (plain, corrected))
    assert pytest.approx(1.1 * expected.E) == reading.E
    assert reading.others["apparent"] == pytest.approx(1.1 * expected.others["apparent"])
    assert reading.relaxation == pytest.approx(expected.relaxation)


def test_saddle_drops_out_of_a_press_on_flesh_that_relaxes(square):
    """A cheek that is turned by 45 degrees, of the mean curvature of the design, 1/35 per mm."""
    times = times_of(square.design)
    cheek = {"shape": "ellipsoid", "radius_mm": 28.0, "radius_across_mm": 140.0 / 3.0, "azimuth_deg": 45.0}
    reading = read_log(square.measuring(), times, dome_press(square, 1.0, times, **cheek))
    assert abs(reading.E - 1.0) <= reading.u
    assert pytest.approx(1.0, abs=0.05) == reading.E
    assert abs(reading.offset) > 5.0 * reading.offset_u


@pytest.mark.parametrize("lead", [0.0, 0.05, -0.05])
def test_pair_reads_the_first_instant_however_one_tip_leads(pair, lead):
    """0.05 mm over 8 mm are 0.36 degrees, by which the force ratio alone would be 10 % off."""
    times = times_of(pair.design)
    level = reading_over_time(pair.sensor)
    late = pair.design.stop_s + LATE_FRACTION * pair.design.press.hold_s
    for E, apparent in ((0.5, level.apparent[0]), (2.5, level.apparent[4])):
        reading = read_log(pair.measuring(), times, pair_press(pair, E, times, lead))
        assert pytest.approx(E, rel=6e-3) == reading.E  # what lies below the noise is not seen
        assert abs(reading.E / E - 1.0) <= reading.u
        at_stop, at_last = np.interp([pair.design.stop_s, late], level.t[1:], apparent[1:])
        assert reading.others["apparent"] == pytest.approx(at_stop, rel=0.05)  # a tip that comes late is younger
        assert reading.relaxation == pytest.approx(at_last / at_stop, rel=0.03)


def test_flesh_of_another_relaxation_is_told_by_its_ratio(pair):
    times = times_of(pair.design)
    of_arms = [
        read_log(pair.measuring(), times, pair_press(pair, 1.5, times, arms=arms)).relaxation
        for arms in (ARMS, ((1e-6, 1.0),))
    ]
    assert of_arms[0] < 0.9
    assert of_arms[1] == pytest.approx(1.0, abs=1e-4)


def test_springs_that_creep_are_no_relaxation_of_the_flesh(pair):
    """Springs that give way by g in the hold show g times the force that they bear."""
    sensor, times = pair.measuring(), times_of(pair.design)
    unit = replace(sensor.unit, creep_per_decade=0.06, creep_error=0.0, weighed_after_s=30.0)
    creeping = replace(sensor, unit=unit)
    forces = pair_press(pair, 1.5, times)
    still, soft = (read_log(each, times, forces).relaxation for each in (sensor, creeping))
    g = creeping.creep.growth_in_hold(LATE_FRACTION * pair.design.press.hold_s, pair.design.stop_s)
    assert g > 1.01
    assert soft == pytest.approx(still / g, rel=1e-3)  # the offset is read with stiffer springs


def test_press_that_ends_early_has_no_modulus_or_no_ratio(square):
    times = times_of(square.design, until=0.2)
    reading = read_log(square.measuring(), times, dome_press(square, 1.0, times))
    assert (reading.E, reading.flags) == (None, ("released_early",))
    times = times_of(square.design, until=0.5)
    reading = read_log(square.measuring(), times, dome_press(square, 1.0, times))
    assert reading.relaxation is None
    assert pytest.approx(1.0, rel=5e-3) == reading.E


@pytest.mark.parametrize("words", ["--forces 0.4,1.1", "--each press.csv", "--c-header file", "--micropython file"])
def test_what_knows_no_moment_is_refused(words, pair, monkeypatch, capsys):
    monkeypatch.setattr("twintip.commands.read.read_report", lambda _: pair.report)
    assert main(["read", "folder", *words.split()]) == 2
    assert capsys.readouterr().err.splitlines()[-1].startswith(f"pipeline: {words.split()[0]}")
