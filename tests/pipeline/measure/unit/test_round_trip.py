"""Forces of the contact engine, of units unlike their design and with noise, are read back within the stated error."""

from dataclasses import replace

import numpy as np
import pytest
from measured_units import MeasuredDesign, random_pose

from pipeline.measure.unit.pair_press import PairPress
from pipeline.measure.unit.presses import reading_of
from solve.contact.poses import Pose

FRUIT = 1000
PRINTED, WEIGHED, GAIN = 0.12, 0.01, 0.005  # standard deviations of a print, its calibration and its channels
LEAST_COVERED = 0.95 - 3.0 * np.sqrt(0.95 * 0.05 / FRUIT)  # three sigma of a fair count of 95 %
PRESS = np.linspace(0.1, 0.6, 6)


def drawn_units(measured, rng, units):
    """Yield calibrated units of a design, the factors of their springs, gains and noises, and fruit for each."""
    count = len(measured.K)
    for _ in range(units):
        factors = rng.normal(1.0, PRINTED, count).clip(0.6, 1.4)
        known = factors * rng.normal(1.0, WEIGHED, count)
        sensor = measured.measuring(known, 100.0 * WEIGHED, 100.0 * GAIN)
        moduli = np.exp(rng.uniform(np.log(0.5), np.log(3.5), FRUIT // units))
        poses = [random_pose(measured.design, rng, E, measured.design.press.travel_mm) for E in moduli.tolist()]
        yield sensor, factors, rng.normal(1.0, GAIN, count), poses


def noisy(forces, sensor, gains, rng):
    return forces * gains + np.array(sensor.noises) * rng.normal(size=forces.shape)


def coverage(readings):
    """Return the share of readings, each with its modulus [MPa], that hold it within the stated error."""
    told = [(reading, E) for reading, E in readings if reading.E is not None]
    assert len(told) >= 0.95 * len(readings)
    return np.mean([abs(reading.E / E - 1.0) <= reading.u for reading, E in told])


def contrast_readings(measured, rng, units):
    for sensor, factors, gains, poses in drawn_units(measured, rng, units):
        forces = noisy(measured.forces(poses, factors), sensor, gains, rng)
        yield from ((reading_of(sensor, row), pose.E) for row, pose in zip(forces.tolist(), poses, strict=True))


def test_square_covers_the_truth(mango, rng):
    readings = list(contrast_readings(mango, rng, units=50))
    assert coverage(readings) >= LEAST_COVERED


def test_planted_spring_is_not_covered(mango, rng):
    """A calibration that takes one spring for 30 % too stiff, and says that it knows it to 1 %."""
    readings = []
    for sensor, factors, gains, poses in drawn_units(mango, rng, units=20):
        forces = noisy(mango.forces(poses, factors), sensor, gains, rng)
        wrong = sensor.with_stiffness(0, 1.3)
        readings += [(reading_of(wrong, row), pose.E) for row, pose in zip(forces.tolist(), poses, strict=True)]
    assert coverage(readings) < 0.9


@pytest.mark.slow
def test_line_covers_the_truth(rng):
    line = MeasuredDesign("fouly", reading={"tilt_deg": 2.0, "off_centre_mm": 0.0, "radius_spread": 0.0})
    sensor, moduli = line.measuring(), np.geomspace(0.5, 3.5, 9).tolist()
    level = [Pose(E=E, travel=line.design.press.travel_mm) for E in moduli]
    for forces, E in zip(line.forces(level).tolist(), moduli, strict=True):
        assert pytest.approx(E, rel=1e-3) == reading_of(sensor, forces).E
    assert coverage(list(contrast_readings(line, rng, units=8))) >= LEAST_COVERED


@pytest.mark.slow
def test_pair_covers_the_truth(rng):
    """On its flat block, tilted by up to 2 degrees; six samples make a press."""
    pair = MeasuredDesign("paper", reading={"tilt_deg": 2.0, "off_centre_mm": 0.0, "radius_spread": 0.0})
    readings = []
    for sensor, factors, gains, poses in drawn_units(pair, rng, units=8):
        pressed = [replace(pose, travel=x) for pose in poses for x in PRESS.tolist()]
        forces = noisy(pair.forces(pressed, factors), sensor, gains, rng).reshape(len(poses), len(PRESS), -1)
        readings += [(read_press(sensor, press), pose.E) for press, pose in zip(forces.tolist(), poses, strict=True)]
    assert coverage(readings) >= LEAST_COVERED


def read_press(sensor, press):
    found = PairPress(sensor)
    for soft, stiff in press:
        if soft > sensor.least_forces[0] and stiff > sensor.least_forces[1]:
            found.add(soft, stiff)
    return found.reading()
