"""A second method to read a pair of tips: the modulus from the ratio of the two forces at one moment."""

import numpy as np

from instrument.press.fruit_reading import FruitReading, flags_of_forces, flags_of_modulus
from instrument.press.half_width import Deviations, half_width
from instrument.press.measuring import MeasuringUnit
from sensor.arrays import Floats
from sensor.theory.contrast_law import ReadingError, ReadingSlopes, contrast_slopes
from sensor.theory.contrast_rise import BendSlopes


def single_reading(sensor: MeasuringUnit, forces: Floats) -> FruitReading:
    """Return the reading of a pair from the ratio of its `forces` (2,) [N] in one sample.

    If the sensor is tilted, one tip touches first, which changes the ratio. The uncertainty includes the tilt that the
    design allows. The reading has no modulus if a force is implausible or a tip is out of contact, as its flags state.
    If no modulus yields this ratio, the reading only has the flag `out_of_range`.
    """
    force_flags = flags_of_forces(sensor, forces)
    if force_flags:
        return FruitReading(flags=force_flags)
    try:
        E = sensor.correct_modulus(sensor.ratio_modulus(forces))
    except ReadingError:
        return FruitReading(flags=("out_of_range",))
    slopes = _ratio_slopes(sensor, forces)
    noise_error = float(np.linalg.norm(np.multiply(slopes.forces, sensor.noises)))
    tilt_error = slopes.contrast * sensor.lead_deviation
    unit_errors = sensor.channels.moment_uncertainty(slopes, forces)
    bend = _bend_error(sensor, slopes, forces)
    # Noise and tilt vary from press to press.
    parts = half_width(sensor, E, Deviations.with_unit([noise_error, tilt_error], unit_errors), bend)
    u = parts.total
    # Springs are stiffer in a press than under calibration weights, so the true forces are larger by this factor.
    true_forces = sensor.press_stiffness_ratio() * forces
    return FruitReading(
        E=E,
        reduced=sensor.reduced(E),
        u=u,
        flags=tuple(flags_of_modulus(sensor, E, u, true_forces)),
        ripeness=sensor.ripeness_of(E),
        bend=bend,
        firmness=sensor.firmness_of(E),
        parts=parts,
    )


def _bend_error(sensor: MeasuringUnit, slopes: ReadingSlopes, forces: Floats) -> float:
    """Return the absolute error of the uncorrected ln E [1] that nonlinear channels and springs cause.

    `slopes` are the slopes of ln E against each cause of error, if it is read from the ratio of `forces` (2,) [N].
    """
    gain_slopes = np.multiply(slopes.forces, forces)  # d ln E / d ln(gain) of each channel
    stiffness_slopes = np.array(slopes.springs)  # d ln E / d ln(stiffness) of each spring
    return sensor.bend_error(_bend_slopes(gain_slopes, forces), _bend_slopes(stiffness_slopes, forces))


def _bend_slopes(relative_slopes: Floats, forces: Floats) -> BendSlopes:
    """Return the slopes of ln E against the bends of the calibration curves, for `forces` (2,) [N] at one moment.

    `relative_slopes` (2,) [1] are the derivatives of ln E with respect to the logarithm of each gain or stiffness. A
    force at one moment is measured from zero, along a chord of the calibration curve. The chord of a parabola has the
    slope that the parabola has at half the force, hence the factor 0.5.
    """
    return BendSlopes(at_zero=tuple(relative_slopes.tolist()), per_N=tuple((0.5 * relative_slopes * forces).tolist()))


def ratio_modulus_and_noise(sensor: MeasuringUnit, forces: Floats) -> tuple[float, float]:
    """Return the modulus [MPa] from the ratio of `forces` [N], and its relative standard deviation due to the channels.

    Raises ReadingError if no modulus yields this ratio.
    """
    slopes = _ratio_slopes(sensor, forces)
    return sensor.ratio_modulus(forces), float(np.linalg.norm(np.multiply(slopes.forces, sensor.channels.errors)))


def _ratio_slopes(sensor: MeasuringUnit, forces: Floats) -> ReadingSlopes:
    """Return the slopes of ln E against each cause of error, if the modulus is read from the ratio of `forces` [N].

    Raises ReadingError if no modulus yields this ratio.
    """
    return contrast_slopes(sensor.rise_law.contrast, forces.tolist(), sensor.ratio_modulus(forces))
