"""A press of a line or a square: the contrast of its tips, weighed over the samples up to the deepest one."""

import math

import numpy as np
from numpy.typing import NDArray

from cad.theory.contrast_law import (
    ContrastLaw,
    PressMeans,
    ReadingError,
    contrast_slopes,
    lowered_tips,
    plane_through,
    read_modulus,
)
from pipeline.measure.unit.fruit_reading import (
    FruitReading,
    Sensitivity,
    checked_reading,
    flags_of_forces,
    half_width,
)
from pipeline.measure.unit.measuring import MeasuringUnit

Floats = NDArray[np.float64]


class ContrastPress:
    """The samples of one press of a unit, of whatever length, in a memory that does not grow."""

    def __init__(self, sensor: MeasuringUnit, law: ContrastLaw) -> None:
        """Begin a press."""
        self._sensor = sensor
        self._law = law
        self._means = PressMeans()
        self._to_deepest = PressMeans()
        self._deepest = np.zeros(len(law.weights))

    def add(self, forces: Floats) -> None:
        """Take the forces of all tips [N] in the next sample, each above 0."""
        self._means = self._means.with_sample(forces)
        if forces.sum() > self._deepest.sum():
            self._deepest = forces
            self._to_deepest = self._means

    def reading(self) -> FruitReading:
        """Return what the press tells. Samples after the deepest one are left out: by then flesh may have yielded."""
        sensor = self._sensor
        means = self._to_deepest
        forces = means.forces.tolist()
        try:
            read = read_modulus(self._law, forces, means.two_thirds)
        except ReadingError:
            return FruitReading(flags=("out_of_range",))
        slopes = contrast_slopes(self._law, forces, read, means.two_thirds)
        by_force = np.array(slopes.forces)
        by_noise = float(np.linalg.norm(by_force * sensor.noises)) / math.sqrt(means.alike)
        by_drift = float(np.linalg.norm(by_force * sensor.zero_drifts))
        by_unit = Sensitivity(np.array(slopes.springs), by_force * means.forces).by_unit(sensor)
        by_heights = np.multiply(slopes.heights, sensor.unit.height_error_mm)
        E = sensor.corrected(read)
        u = half_width(sensor, E, [by_noise, by_drift, *by_unit, *by_heights])

        lowered = lowered_tips(self._law, self._deepest.tolist(), read)
        _, along, across = plane_through(sensor.design.tips.axes_mm, lowered)
        # A dome rolls on a round fruit: a tilt by 1 lowers it as one by R / (r + R) would lower a point.
        rolling = 1.0 + (sensor.design.tips.dome_radius_mm or 0.0) / sensor.design.fruit.radii_mm[0]
        tilt = math.degrees(math.atan(rolling * math.hypot(along, across or 0.0)))
        direction = None if across is None else math.degrees(math.atan2(across, along))
        reading = checked_reading(sensor, E, u, self._deepest, tilt=tilt, direction=direction)
        return reading.of_samples(means.count, sensor.steepness(E) * by_noise)


def contrast_reading(sensor: MeasuringUnit, law: ContrastLaw, forces: Floats) -> FruitReading:
    """Return what one reading of a line or a square tells: a press of one sample, forces [N] one for each tip."""
    flags = flags_of_forces(sensor, forces)
    if flags:
        return FruitReading(flags=flags)
    press = ContrastPress(sensor, law)
    press.add(forces)
    return press.reading()
