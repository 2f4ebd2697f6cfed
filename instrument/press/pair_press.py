"""A second reading of a pair: the modulus from the ratio of its two forces at one moment."""

import numpy as np

from instrument.press.fruit_reading import FruitReading, flags_of_forces, flags_of_modulus
from instrument.press.half_width import Deviations, half_width
from instrument.press.measuring import MeasuringUnit
from sensor.arrays import Floats
from sensor.theory.contrast_law import ReadingError, ReadingSlopes, contrast_slopes
from sensor.theory.contrast_rise import BendSlopes


def single_reading(sensor: MeasuringUnit, forces: Floats) -> FruitReading:
    """Return the reading of a pair from the ratio of its forces in one sample, (2,) [N].

    A tilt makes one tip lead, which changes the ratio. The uncertainty includes the tilt that the design allows. Flags
    take the place of a modulus if the forces are implausible, a tip is out of contact, or no modulus fits.
    """
    flags = flags_of_forces(sensor, forces)
    if flags:
        return FruitReading(flags=flags)
    try:
        E = sensor.corrected(sensor.ratio_modulus(forces))
    except ReadingError:
        return FruitReading(flags=("out_of_range",))
    slopes = _ratio_slopes(sensor, forces)
    noise_error = float(np.linalg.norm(np.multiply(slopes.forces, sensor.noises)))
    tilt_error = slopes.contrast * sensor.lead_deviation
    unit_errors = sensor.channels.moment_uncertainty(slopes, forces)
    # The force of one moment is a chord from zero; it has the slope of a parabola at half the force.
    channels, springs = (
        BendSlopes(at_zero=tuple(relative.tolist()), per_N=tuple((0.5 * relative * forces).tolist()))
        for relative in (np.multiply(slopes.forces, forces), np.array(slopes.springs))
    )
    bend = sensor.bend_error(channels, springs)
    parts = half_width(sensor, E, Deviations.with_unit([noise_error, tilt_error], unit_errors), bend)
    u = parts.total
    return FruitReading(
        E=E,
        reduced=sensor.reduced(E),
        u=u,
        flags=tuple(flags_of_modulus(sensor, E, u, sensor.press_over_weighed() * forces)),
        ripeness=None if sensor.classes is None else sensor.classes.class_of(E),
        bend=bend,
        firmness=None if sensor.unit.scale is None else sensor.unit.scale.firmness_of(E),
        parts=parts,
    )


def ratio_modulus_and_noise(sensor: MeasuringUnit, forces: Floats) -> tuple[float, float]:
    """Return the modulus [MPa] from the ratio of forces [N], and its relative standard deviation due to the channels.

    Raises ReadingError if no modulus has this ratio.
    """
    slopes = _ratio_slopes(sensor, forces)
    return sensor.ratio_modulus(forces), float(np.linalg.norm(np.multiply(slopes.forces, sensor.channels.errors)))


def _ratio_slopes(sensor: MeasuringUnit, forces: Floats) -> ReadingSlopes:
    """Return the slopes of ln E against each cause of error, for the modulus from the ratio of forces [N].

    Raises ReadingError if no modulus has this ratio.
    """
    return contrast_slopes(sensor.rise_law.contrast, forces.tolist(), sensor.ratio_modulus(forces))
