"""Another reading of a pair: the modulus by the ratio of two forces at one moment."""

import numpy as np

from instrument.press.fruit_reading import FruitReading, flags_of_forces, flags_of_modulus
from instrument.press.half_width import Deviations, half_width
from instrument.press.measuring import MeasuringUnit
from sensor.arrays import Floats
from sensor.theory.contrast_law import ReadingError, ReadingSlopes, contrast_slopes
from sensor.theory.contrast_rise import BendSlopes


def single_reading(sensor: MeasuringUnit, forces: Floats) -> FruitReading:
    """Return the reading of one sample of a pair [N] by its force ratio.

    It is right only if no tilt makes one tip lead. The uncertainty includes the tilt that the design allows.
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
    by_unit = sensor.channels.of_moment(slopes, forces)
    # The force of one moment is a chord from zero; it has the slope of a parabola at half the force.
    channels, springs = (
        BendSlopes(at_zero=tuple(each.tolist()), per_N=tuple((0.5 * each * forces).tolist()))
        for each in (np.multiply(slopes.forces, forces), np.array(slopes.springs))
    )
    bend = sensor.by_bends(channels, springs)
    parts = half_width(sensor, E, Deviations.with_unit([by_noise, by_tilt], by_unit), bend)
    u = parts.of_one_press
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
    """Return the modulus [MPa] by the ratio of forces [N] and its relative error by theirs [1]; raises ReadingError."""
    slopes = _ratio_slopes(sensor, forces)
    return sensor.ratio_modulus(forces), float(np.linalg.norm(np.multiply(slopes.forces, sensor.channels.errors)))


def _ratio_slopes(sensor: MeasuringUnit, forces: Floats) -> ReadingSlopes:
    """Return the slopes of the modulus by the ratio of forces [N]; raises ReadingError."""
    return contrast_slopes(sensor.rise_law.contrast, forces.tolist(), sensor.ratio_modulus(forces))
