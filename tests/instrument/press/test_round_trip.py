"""Forces of the contact engine, of units unlike their design and with noise, are read back within the stated error."""

import copy
from dataclasses import replace

import numpy as np
import pytest
from measured_units import MeasuredDesign, random_pose, read_press

FRUIT = 200  # studies take more
PRINTED, WEIGHED, GAIN = 0.12, 0.01, 0.005  # standard deviations of a print, its calibration and its channels
FLAT = {"tilt_deg": 2.0, "off_centre_mm": 0.0, "radius_spread": 0.0}
PAIR_RISE = np.linspace(0.1, 1.0, 19)
RISE = np.linspace(0.3, 1.0, 14)


def least_covered(fruit=FRUIT):
    """Return the fraction that a fair count of 95 % falls short of once in 700 times: by three sigma."""
    return 0.95 - 3.0 * np.sqrt(0.95 * 0.05 / fruit)


def coverage(measured, rng, units, travels=RISE, wrong=1.0, each=1, fruit=FRUIT):
    """Return the fraction of fruit whose modulus lies within the stated error, over calibrated units in random poses.

    A press has samples at fractions of the full travel, as many at `each`; `wrong` is by how much the first spring is
    taken for stiffer.
    """
    covered = []
    count = len(measured.K)
    for _ in range(units):
        factors = rng.normal(1.0, PRINTED, count).clip(0.6, 1.4)
        estimated = factors * rng.normal(1.0, WEIGHED, count)
        sensor = measured.measuring(estimated, 100.0 * WEIGHED, 100.0 * GAIN).with_stiffness(0, wrong)
        gains = rng.normal(1.0, GAIN, count)
        moduli = np.exp(rng.uniform(np.log(0.5), np.log(3.5), fruit // units)).tolist()
        poses = []
        for E in moduli:
            pose = random_pose(measured.design, rng, E, measured.design.press.travel_mm)
            poses += [replace(pose, travel=pose.travel * fraction) for fraction in travels]
        forces = np.repeat(measured.forces(poses, factors) * gains, each, axis=0)
        noisy = (forces + np.array(sensor.noises) * rng.normal(size=forces.shape)).reshape(len(moduli), -1, count)
        for E, press in zip(moduli, noisy, strict=True):
            reading = read_press(sensor, press)
            if reading.E is not None:
                covered.append(abs(reading.E / E - 1.0) <= reading.u)
    assert len(covered) >= 0.95 * units * (fruit // units)
    return np.mean(covered)


def with_noise_of_the_design(measured):
    """Return a design with noise of 0.5 % of full scale in place of that of its read-out."""
    noisy = copy.copy(measured)
    noisy.report = replace(measured.report, read_out=replace(measured.report.read_out, signal=None))
    return noisy


def test_whole_presses_of_a_square_cover_the_truth(mango, rng):
    """With noise of 0.5 % of full scale, of which five samples at each depth leave little: the rest has to hold."""
    noisy = with_noise_of_the_design(mango)
    assert coverage(noisy, rng, units=20, each=5) >= least_covered()


def test_a_planted_spring_does_not_cover_the_truth(mango, rng):
    """It is taken for 10 % too stiff, and said to be known to 1 %."""
    assert coverage(mango, rng, units=20, wrong=1.1) < 0.9


@pytest.mark.study
def test_line_covers_the_truth(rng):
    line = MeasuredDesign("docs/examples/fouly.toml", reading=FLAT)
    assert coverage(line, rng, units=8, fruit=1000) >= least_covered(1000)


@pytest.mark.study
def test_pair_covers_the_truth(rng):
    """On its flat block, tilted by up to 2 degrees, with noise of 0.3 % of full scale."""
    pair = MeasuredDesign("paper", reading={**FLAT, "noise_percent": 0.3})
    assert coverage(pair, rng, units=8, travels=PAIR_RISE, fruit=1000) >= least_covered(1000)
