"""A press of a square read whole: what noise makes falls with the samples, what is alike in all of them does not.

Forces are those of the contact engine, which knows nothing of the means that are read.
"""

import copy
from dataclasses import replace

import numpy as np
import pytest

from cad.theory.contrast_law import read_modulus
from pipeline.measure.unit.contrast_press import ContrastPress, contrast_reading
from pipeline.measure.unit.presses import readings_of
from pipeline.measure.unit.signals import Signal
from solve.contact.poses import Pose

E = 1.0
SHARES = np.linspace(0.45, 1.0, 8)
TILT = (1.0, -0.5)
DRAWS = 200


@pytest.fixture(scope="module")
def noisy(mango):
    """Return the mango with noise of 0.5 % of full scale in place of its read-out's, which is a hundredth of that."""
    noisy = copy.copy(mango)
    noisy.report = replace(mango.report, read_out=replace(mango.report.read_out, signal=None))
    return noisy


@pytest.fixture(scope="module")
def going_in(mango):
    """Return the forces [N] at eight travels, the last one full."""
    travel = mango.design.press.travel_mm
    return mango.forces([Pose(E=E, travel=float(share) * travel, tilt_deg=TILT) for share in SHARES])


def read(sensor, forces):
    press = ContrastPress(sensor, sensor.law)
    for row in forces:
        press.add(row)
    return press.reading()


def read_often(sensor, forces, rng):
    """Return readings of the same forces, each with noise of its own."""
    return [read(sensor, forces + sensor.noises * rng.normal(size=forces.shape)) for _ in range(DRAWS)]


def test_noise_falls_as_the_root_of_the_samples_and_is_stated(noisy, going_in, rng):
    """A scatter of 200 draws is known to 5 %, so that three deviations are 15 %; a mean, to four of its own."""
    sensor = noisy.measuring()
    plain = read(sensor, going_in).E
    assert plain == pytest.approx(contrast_reading(sensor, sensor.law, going_in[-1]).E, rel=3e-3)
    scatters = []
    for each in (1, 4, 16, 64):
        forces = np.repeat(going_in, each, axis=0)
        readings = read_often(sensor, forces, rng)
        moduli = np.array([reading.E for reading in readings]) / plain
        scatters.append(moduli.std())
        assert abs(moduli.mean() - 1.0) < 4.0 * moduli.std() / np.sqrt(DRAWS)
        assert np.mean([reading.noise for reading in readings]) == pytest.approx(2.0 * moduli.std(), rel=0.15)
        assert {reading.samples for reading in readings} <= set(range(7 * each, 8 * each + 1))
    assert np.array(scatters[:3]) / scatters[1:] == pytest.approx([2.0] * 3, rel=0.25)


def test_gains_springs_and_heights_do_not_fall_with_the_samples(noisy, going_in):
    """A gain that is 2 % off is off by as much in eight samples as in eight hundred, and is in what is left.

    At one depth: in presses that go in, more samples at each depth also shift what each depth weighs.
    """
    sensor = noisy.measuring(percent=1.0, gain_percent=2.0)
    wrong = np.array([1.0, 1.02, 1.0, 1.0])
    readings = []
    for count in (8, 800):
        forces = np.repeat(going_in[-1:], count, axis=0)
        rising = 1.0 + 1e-9 * np.arange(len(forces))  # so that the last sample is the deepest
        readings.append(read(sensor, wrong * forces * rising[:, None]))
    few, many = readings
    assert pytest.approx(few.E, rel=1e-6) == many.E
    assert many.left == pytest.approx(few.left, rel=1e-4)
    assert many.noise == pytest.approx(0.1 * few.noise, rel=1e-4)
    assert many.u == pytest.approx(np.hypot(many.noise, many.left))
    off = abs(many.E / read(sensor, going_in).E - 1.0)
    assert 3.0 * many.noise < off < many.left


def test_a_sample_weighs_by_the_force_of_the_one_before(noisy, going_in):
    """The means by NumPy's average, the first sample by its own force."""
    sensor = noisy.measuring(gain_percent=2.0)
    forces = going_in * np.array([1.0, 1.02, 1.0, 1.0])
    wholes = forces.sum(axis=1)
    weights = np.concatenate([wholes[:1], wholes[:-1]]) ** 2
    means = np.average(forces, axis=0, weights=weights)
    two_thirds = np.average(np.cbrt(forces) ** 2, axis=0, weights=weights)
    plain = read(sensor, forces)
    expected = sensor.corrected(read_modulus(sensor.law, means.tolist(), two_thirds))
    assert pytest.approx(expected, rel=1e-12) == plain.E


def test_gains_springs_and_heights_move_a_press_as_is_said(noisy, going_in):
    """Each by the change of what is planted in a press that is read anew, and by what it adds to the bar."""
    sensor = noisy.measuring()
    unit = replace(sensor.unit, height_error_mm=(0.0,) * 4)
    plain = read(replace(sensor, unit=unit), going_in)
    step = 1e-3
    for planted, stated in (
        ({"height_mm": (0.0, step, 0.0, 0.0)}, {"height_error_mm": (0.0, 10.0 * step, 0.0, 0.0)}),
        ({"K_N_per_m": (unit.K_N_per_m[0] * 1.001, *unit.K_N_per_m[1:])}, {"K_percent": (1.0, 1e-9, 1e-9, 1e-9)}),
    ):
        moved = read(replace(sensor, unit=replace(unit, **planted)), going_in)
        wider = read(replace(sensor, unit=replace(unit, **stated)), going_in)
        expected = 2.0 * 10.0 * abs(moved.E / plain.E - 1.0)
        assert np.sqrt(wider.u**2 - plain.u**2) == pytest.approx(expected, rel=0.03)
    wider = read(replace(sensor, unit=replace(unit, gain_percent=(0.0, 1.0, 0.0, 0.0))), going_in)
    moved = read(sensor, np.array([1.0, 1.001, 1.0, 1.0]) * going_in)
    expected = 2.0 * 10.0 * abs(moved.E / plain.E - 1.0)
    assert np.sqrt(wider.u**2 - plain.u**2) == pytest.approx(expected, rel=0.03)


def test_a_hold_is_not_read_by_its_noisiest_sample(noisy, going_in, rng):
    """The deepest of a hundred samples at rest is the one whose noise adds most: by itself it reads too firm."""
    sensor = noisy.measuring()
    hold = np.repeat(going_in[-1:], 100, axis=0)
    true = contrast_reading(sensor, sensor.law, going_in[-1])
    whole = []
    deepest = []
    for _ in range(DRAWS):
        forces = hold + sensor.noises * rng.normal(size=hold.shape)
        whole.append(read(sensor, forces).E / true.E - 1.0)
        deepest.append(contrast_reading(sensor, sensor.law, forces[forces.sum(axis=1).argmax()]).E / true.E - 1.0)
    of_one = 0.5 * true.noise
    assert np.mean(deepest) > of_one
    assert abs(np.mean(whole)) < 0.15 * of_one


def test_way_out_of_the_fruit_does_not_count(noisy, going_in):
    """A fruit that gives back nine tenths of its force on the way out reads as it did on the way in."""
    sensor = noisy.measuring()
    back = 0.9 * going_in[::-1]
    assert read(sensor, np.concatenate([going_in, back])) == read(sensor, going_in)


def test_a_signal_is_read_whole_once_a_press(noisy, going_in):
    air = np.zeros((3, 4))
    rows = np.concatenate([air, going_in, going_in[::-1], air, 0.9 * going_in, air])
    lines = ["t_s,F_1_N,F_2_N,F_3_N,F_4_N"]
    lines += [",".join(f"{value:.12g}" for value in (0.01 * k, *row)) for k, row in enumerate(rows.tolist())]
    sensor = noisy.measuring()
    first, second = readings_of(sensor, Signal(lines, "press.csv", 4))
    assert pytest.approx(read(sensor, going_in).E, rel=1e-9) == first.E
    assert pytest.approx(read(sensor, 0.9 * going_in).E, rel=1e-9) == second.E
    assert [(reading.samples, reading.t) for reading in (first, second)] == [
        (8, pytest.approx(0.10)),
        (8, pytest.approx(0.29)),
    ]
    every = list(readings_of(sensor, Signal(lines, "press.csv", 4), every_sample=True))
    assert len(every) == 24
    assert pytest.approx(contrast_reading(sensor, sensor.law, going_in[-1]).E, rel=1e-9) == every[7].E
