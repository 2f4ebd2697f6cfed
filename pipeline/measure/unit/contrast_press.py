"""Presses of a unit by the rise of the contrast of its tips, and single moments of a line or a square by its state."""

import math

import numpy as np

from cad.arrays import Floats
from cad.quantity import COVERAGE
from cad.theory.contrast_law import (
    ContrastLaw,
    ReadingError,
    contrast_slopes,
    lowered_tips,
    plane_through,
    read_modulus,
)
from cad.theory.contrast_rise import LARGEST_BY_TIME, RiseError, RiseReading, RiseSlopes
from pipeline.measure.unit.fruit_reading import (
    FruitReading,
    Sensitivity,
    checked_reading,
    flags_of_forces,
    half_width,
)
from pipeline.measure.unit.measuring import MeasuringUnit
from pipeline.measure.unit.pair_press import Stroke, with_force_ratio
from pipeline.measure.unit.seating import SeatedPress


class ContrastPress:
    """The samples of one press of a unit, of whatever length, in a memory that does not grow.

    Samples after the deepest one are left out: by then flesh may have yielded. What is the same in all samples drops
    out of the modulus: the saddle of the skin, the heights and places of the tips, how the sensor stands. `lag` is from
    how many samples before noise is independent, `time_deviation_s` the standard deviation of the time of each channel.
    """

    def __init__(self, sensor: MeasuringUnit, *, lag: int = 1, time_deviation_s: float = 0.0) -> None:
        """Begin a press."""
        self._sensor = sensor
        self._time_deviation = time_deviation_s
        self._press = SeatedPress(sensor, sensor.rise_law, lag=lag)
        self._stroke = Stroke(sensor, lag) if sensor.is_pair else None

    def add(self, forces: Floats, x: float | None = None, elapsed: float | None = None) -> None:
        """Take the forces of all tips [N] in the next sample, and the time elapsed since the one before [s].

        The travel x [mm] is taken where it is measured.
        """
        self._press.add(forces, elapsed)
        if self._stroke is not None and x is not None:
            self._stroke.add(forces, x)

    def reading(self) -> FruitReading:
        """Return what the press tells, with the flag of its cause where that is nothing.

        Beside it, in `others`, a pair has what the force ratio and the stroke tell.
        """
        sensor = self._sensor
        try:
            load, found = self._press.reading()
        except RiseError as error:
            return FruitReading(flags=(error.flag,))
        E = sensor.rise_corrected(found.E)
        steepness = sensor.rise_steepness(E)
        left_open = sensor.left_open(self._time_deviation).of_press(found.slopes)
        shape = _by_shape(sensor, found.slopes)
        u = half_width(sensor, E, steepness, [found.noise, *left_open.values(), *shape])
        if self._stroke is None:
            reading = self._with_offset(found, E, u)
        else:
            reading = checked_reading(sensor, E, u, self._press.deepest, lead=found.offset)
            reading = self._stroke.beside(with_force_ratio(sensor, reading, found, self._press.deepest), load)
        if left_open["times"] > LARGEST_BY_TIME:
            reading = reading.flagged("too_fast")
        return reading.of_samples(found.samples, steepness * found.noise)

    def _with_offset(self, found: RiseReading, E: float, u: float) -> FruitReading:
        """Return a reading E [MPa] +- u [1] of a line or a square with its pose and its offset, which is no tilt."""
        law = self._sensor.rise_law.with_offset(found.offset)
        reading = _with_pose(self._sensor, law, self._press.deepest, found.E, E, u)
        steepness = self._sensor.rise_steepness(E)
        left = reading.of_samples(found.samples, steepness * found.noise).left or 0.0
        # A gap of the high tips above that of the low ones is what they stand farther from the skin.
        offset_u = math.hypot(COVERAGE * found.offset_noise, found.offset_per_log_E * left)
        return reading.with_offset(-found.offset, offset_u)


def _by_shape(sensor: MeasuringUnit, slopes: RiseSlopes) -> list[float]:
    """Return what the shape of the fruit and the heights of the tips leave open of the modulus of a press [1].

    Each is one standard deviation. Heights that are off count as a saddle, which moves the points of contact.
    """
    weights = np.array(sensor.law.weights)
    domes = sensor.domes
    by_curvature = 0.0
    if domes is not None:
        by_curvature = slopes.mean_curvature(domes.relative_radius) * sensor.curvature_deviation
    return [by_curvature, *(slopes.offset * weights * sensor.height_deviation).tolist()]


def contrast_reading(sensor: MeasuringUnit, law: ContrastLaw, forces: Floats) -> FruitReading:
    """Return what a single moment of a line or a square tells: forces [N], one for each tip.

    Its bar holds heights of tips and the saddle of the skin, which no single moment can tell from the modulus.
    """
    flags = flags_of_forces(sensor, forces)
    if flags:
        return FruitReading(flags=flags)
    try:
        read = read_modulus(law, forces.tolist())
    except ReadingError:
        return FruitReading(flags=("out_of_range",))
    slopes = contrast_slopes(law, forces.tolist(), read)
    by_force = np.array(slopes.forces)
    by_noise = float(np.linalg.norm(by_force * sensor.noises))
    by_drift = float(np.linalg.norm(by_force * sensor.zero_drifts))
    by_unit = Sensitivity(np.array(slopes.springs), by_force * forces).by_unit(sensor)
    by_heights = np.multiply(slopes.heights, sensor.height_deviation).tolist()
    by_shape = slopes.contrast * sensor.saddle_contrast
    E = sensor.corrected(read)
    steepness = sensor.steepness(E)
    u = half_width(sensor, E, steepness, [by_noise, by_drift, *by_unit.values(), *by_heights, by_shape])
    return _with_pose(sensor, law, forces, read, E, u).of_samples(1, steepness * by_noise)


def _with_pose(
    sensor: MeasuringUnit, law: ContrastLaw, forces: Floats, read: float, E: float, u: float
) -> FruitReading:
    """Return a reading E [MPa] +- u [1] with the tilt that forces [N] tell of flesh that a law reads as `read` [MPa].

    An offset of the contrast is no plane, so that it does not change the tilt.
    """
    lowered = lowered_tips(law, forces.tolist(), read)
    _, along, across = plane_through(sensor.design.tips.places_mm, lowered)
    # A dome rolls on a round fruit: a tilt by 1 lowers it as one by R / (r + R) would lower a point.
    rolling = 1.0 if sensor.domes is None else sensor.domes.rolling_factor
    tilt = math.degrees(math.atan(rolling * math.hypot(along, across or 0.0)))
    direction = None if across is None else math.degrees(math.atan2(across, along))
    return checked_reading(sensor, E, u, forces, tilt=tilt, direction=direction)
