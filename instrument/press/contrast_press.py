"""Presses of a unit, read by the rise of the contrast of its tips."""

import math
from dataclasses import replace

import numpy as np

from instrument.press.fruit_reading import FruitReading, checked_reading, half_width
from instrument.press.measuring import MeasuringUnit
from instrument.press.pair_press import with_force_ratio
from instrument.press.relaxing_flesh import Hold
from instrument.press.seating import SeatedPress
from sensor.arrays import Floats
from sensor.quantity import COVERAGE
from sensor.theory.contrast_law import lowered_tips, plane_through
from sensor.theory.contrast_rise import LARGEST_BY_TIME, RiseError, RiseReading, RiseSlopes


class ContrastPress:
    """The samples of one press of a unit, of whatever length, in a memory that does not grow.

    Samples after the deepest one are left out: by then flesh may have yielded. What is the same in all samples drops
    out of the modulus. This is the saddle of the skin, the heights and places of the tips, and how the sensor stands.
    `lag` is from how many samples before noise is independent, `time_deviation_s` the standard deviation of the time of
    each channel. With a `hold`, the channels are those of `RelaxingFlesh`.
    """

    def __init__(
        self, sensor: MeasuringUnit, *, lag: int = 1, time_deviation_s: float = 0.0, hold: Hold | None = None
    ) -> None:
        """Begin a press."""
        self._sensor = sensor
        self._lag = lag
        self._time_deviation = time_deviation_s
        self._hold = hold
        self._law = sensor.rise_law if hold is None else sensor.rise_law.over_time
        self._press = SeatedPress(sensor, self._law, lag=lag)
        self._before: float | None = None

    def add(self, channels: Floats, t: float | None = None) -> None:
        """Take the channels of the next sample [N], the forces of all tips first, and its time [s]."""
        elapsed = None if t is None or self._before is None else t - self._before
        self._before = t
        self._press.add(channels, elapsed)
        if self._hold is not None and t is not None:
            self._hold.add(channels[: self._tips], t)

    @property
    def _tips(self) -> int:
        return len(self._sensor.law.weights)

    def reading(self, press_s: float | None = None) -> FruitReading:
        """Return what the press tells, with the flag of its cause where that is nothing.

        `press_s` [s] is its duration from the first touch to the deepest point, where that is known. Beside it, in
        `others`, a pair has what the force ratio tells.
        """
        sensor = self._sensor
        try:
            load, found = self._press.reading()
        except RiseError as error:
            return FruitReading(flags=(error.flag,))
        E = sensor.corrected(found.E, press_s)
        left_open = sensor.left_open(self._time_deviation, press_s).of_press(found.slopes)
        slopes = found.slopes
        bend = sensor.steepness(E) * sensor.by_bends(slopes.channel_bends, slopes.spring_bends)
        u = half_width(sensor, E, [found.noise, *left_open.values(), *_by_shape(sensor, slopes)]) + bend
        deepest = self._press.deepest[: self._tips]
        stiffened = sensor.press_over_weighed(press_s)
        reading = self._with_pose(found, E, u, stiffened)
        reading = replace(reading.of_samples(found.samples, sensor.steepness(E) * found.noise), bend=bend)
        reading = reading.with_shift(self._shift_by_one(E, load, press_s))
        if sensor.reads_moments and self._hold is None:
            reading = with_force_ratio(sensor, reading, found, deepest, press_s)
        if left_open["times"] > LARGEST_BY_TIME:
            reading = reading.with_flag("too_fast")
        if self._hold is None:
            return reading
        contrast = sensor.rise_law.with_offset(found.offset)
        return self._hold.beside(
            reading,
            contrast,
            found.offset,
            lambda held_s: stiffened * sensor.softening_in_hold(held_s, press_s),
        )

    def _shift_by_one(self, E: float, load: int, press_s: float | None) -> float:
        """Return the largest change of E [1] by leaving out what one bad conversion is part of; all of it for no E.

        `press_s` [s] is as `reading` has it.
        """
        moduli = [self._sensor.corrected(found, press_s) for found in self._press.moduli_without(load, self._lag)]
        return max((1.0 if math.isnan(found) else abs(found / E - 1.0) for found in moduli), default=0.0)

    def _with_pose(self, found: RiseReading, E: float, u: float, stiffened: float) -> FruitReading:
        """Return a reading E [MPa] +- u [1] with the tilt of the deepest sample, of a line or a square its offset too.

        The offset of a pair is a tilt, that of other layouts is none. Forces are larger than told where springs are
        `stiffened` [1] against the weighing.
        """
        sensor = self._sensor
        deepest = self._press.deepest
        forces = stiffened * deepest[: self._tips]
        if sensor.is_pair:
            return checked_reading(sensor, E, u, forces, lead=found.offset)
        lowered = lowered_tips(self._law.with_offset(found.offset), deepest.tolist(), found.E)[-self._tips :]
        _, along, across = plane_through(sensor.design.tips.places_mm, lowered)
        # A dome rolls on a round fruit: a tilt by 1 lowers it as one by R / (r + R) would lower a point.
        rolling = 1.0 if sensor.domes is None else sensor.domes.rolling_factor
        tilt = math.degrees(math.atan(rolling * math.hypot(along, across or 0.0)))
        direction = None if across is None else math.degrees(math.atan2(across, along))
        reading = checked_reading(sensor, E, u, forces, tilt=tilt, direction=direction)
        left = reading.of_samples(found.samples, sensor.steepness(E) * found.noise).left or 0.0
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
