"""Another reading of a pair: the modulus by the force ratio of one moment."""

import math
from dataclasses import replace

import numpy as np

from instrument.press.fruit_reading import FruitReading, checked_reading, flags_of_forces, half_width
from instrument.press.measuring import MeasuringUnit
from sensor.arrays import Floats
from sensor.quantity import COVERAGE
from sensor.theory.contrast_law import ReadingError, ReadingSlopes, contrast_slopes
from sensor.theory.contrast_rise import BendSlopes, RiseReading


def single_reading(sensor: MeasuringUnit, forces: Floats) -> FruitReading:
    """Return what one reading of a pair tells [N]: the force ratio, right only where no tilt leads one of its tips.

    The uncertainty holds the tilt that the design allows for.
    """
    flags = flags_of_forces(sensor, forces)
    if flags:
        return FruitReading(flags=flags)
    try:
        E = sensor.corrected(sensor.ratio_modulus(forces))
    except ReadingError:
        return FruitReading(flags=("out_of_range",))
    slopes = _ratio_slopes(sensor, forces)
    by_noise = float(np.linalg.norm(np.multiply(slopes.forces, sensor.noises)))
    by_tilt = slopes.contrast * sensor.lead_deviation
    left_open = sensor.left_open().of_moment(slopes, forces)
    # The force of one moment is a chord from zero, which has the slope of a parabola at half of it.
    channels, springs = (
        BendSlopes(at_zero=tuple(each.tolist()), per_N=tuple((0.5 * each * forces).tolist()))
        for each in (np.multiply(slopes.forces, forces), np.array(slopes.springs))
    )
    bend = sensor.by_bends(channels, springs)
    u = half_width(sensor, E, [by_noise, by_tilt, *left_open.values()]) + sensor.steepness(E) * bend
    return replace(checked_reading(sensor, E, u, sensor.press_over_weighed() * forces), bend=bend)


def with_force_ratio(
    sensor: MeasuringUnit, reading: FruitReading, found: RiseReading, deepest: Floats, press_s: float | None
) -> FruitReading:
    """Return a reading of a press with what the force ratio of its deepest sample [N] tells, flagged where both differ.

    They differ by a tilt, or by noise and the error of the contact model. `press_s` [s] is as `ContrastPress` has it.
    """
    try:
        by_ratio = sensor.ratio_modulus(deepest)
        noise = float(np.linalg.norm(np.multiply(_ratio_slopes(sensor, deepest).forces, sensor.force_errors)))
    except ReadingError:
        return reading.with_flag("read_outs_disagree")
    reading = replace(reading, others={"force_ratio": sensor.corrected(by_ratio, press_s)})
    allowed = COVERAGE * math.hypot(noise, found.noise) + sensor.model_error
    return reading.with_flag("read_outs_disagree") if abs(by_ratio / found.E - 1.0) > allowed else reading


def _ratio_slopes(sensor: MeasuringUnit, forces: Floats) -> ReadingSlopes:
    """Return how the modulus by the force ratio of forces [N] moves; raises ReadingError."""
    return contrast_slopes(sensor.law, forces.tolist(), sensor.ratio_modulus(forces))
