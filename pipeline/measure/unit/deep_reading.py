"""Readings of a pair whose tips go deep: the modulus by the curve of a tip at large strain, and what other laws read.

The curve is that of log neo-Hooke. The law of a real fruit is not known: what the laws of Hencky and of foam read of
the same forces stands beside, and in the uncertainty.
"""

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from cad.quantity import COVERAGE
from cad.theory.contrast_law import ReadingError
from cad.theory.soft_tissue import FLESH_LAWS, LARGEST_POISSON, FleshLawName, large_strain_factor
from pipeline.measure.unit.deep_pair import TOO_DEEP, DeepPair, Samples, one_sample
from pipeline.measure.unit.fruit_reading import FruitReading, Sensitivity, checked_reading, half_width
from pipeline.measure.unit.measuring import MeasuringUnit

Floats = NDArray[np.float64]

_STEP = 1e-4  # of a stiffness or a gain, for slopes of the modulus


def deep_reading(sensor: MeasuringUnit, law: DeepPair, samples: Samples) -> FruitReading:
    """Return what the samples of a press tell: the modulus by the line, `others` by the force ratio and other laws."""
    deepest = samples.forces[-1]
    others = {}
    try:
        line = law.line(samples, sensor.noises)
        for name, flesh in other_laws(sensor, law).items():
            others[name] = flesh.line(samples, sensor.noises).modulus
    except ReadingError as error:
        too_deep = ("deeper_than_solved",) if str(error) == TOO_DEEP else ()
        return FruitReading(flags=("out_of_range", *too_deep))
    E = line.modulus
    u = _half_width(sensor, law, samples, E, line.error, others)
    reading = checked_reading(sensor, E, u, deepest, lead=line.lead)
    reading = reading.of_samples(int(samples.counts.sum()), sensor.steepness(E) * line.error)
    try:
        by_ratio = law.ratio_modulus(deepest)
    except ReadingError:  # a tilt may leave the ratio no modulus
        reading = reading.flagged("read_outs_disagree")
    else:
        others = {"force_ratio": by_ratio, **others}
        by_noise = _sensitivity(sensor, law, one_sample(deepest), by_ratio).by_noise(sensor, deepest)
        noise = math.hypot(line.error, by_noise)
        allowed = curve_contribution(law, samples, E) + sensor.model_error + COVERAGE * noise
        if abs(by_ratio / E - 1.0) > allowed:
            reading = reading.flagged("read_outs_disagree")
    if law.is_beyond(deepest, E):
        reading = reading.flagged("deeper_than_solved")
    return replace(reading, others=others)


def deep_single_reading(sensor: MeasuringUnit, law: DeepPair, forces: Floats) -> FruitReading:
    """Return what one reading of a pair tells [N]: the force ratio, right only where no tilt offsets a tip.

    Raises ReadingError for forces that tell no modulus.
    """
    E = law.ratio_modulus(forces)
    others = {name: flesh.ratio_modulus(forces) for name, flesh in other_laws(sensor, law).items()}
    samples = one_sample(forces)
    by_tilt = sensor.ratio_tilt_deviation(float(law.offset_per_log_E(forces, E)))
    by_noise = _sensitivity(sensor, law, samples, E).by_noise(sensor, forces)
    u = _half_width(sensor, law, samples, E, math.hypot(by_noise, by_tilt), others)
    reading = checked_reading(sensor, E, u, forces)
    reading = replace(reading, others=others)
    return reading.flagged("deeper_than_solved") if law.is_beyond(forces, E) else reading


def _half_width(
    sensor: MeasuringUnit, law: DeepPair, samples: Samples, E: float, deviation: float, others: Mapping[str, float]
) -> float:
    """Return the half width of E [1]: of a standard deviation [1], of springs and gains, curve, law and nu."""
    return half_width(
        sensor,
        E,
        [deviation, *_sensitivity(sensor, law, samples, E).by_unit(sensor)],
        [curve_contribution(law, samples, E), max(abs(modulus / E - 1.0) for modulus in others.values())],
        curve_by_poisson=_by_poisson(sensor, law, samples, E),
    )


def other_laws(sensor: MeasuringUnit, law: DeepPair) -> dict[str, DeepPair]:
    """Return the other laws of flesh by name: the curve times what they put a sharp tip's force apart."""
    nu = sensor.design.fruit.poisson
    neo_hooke = _sharp_tip(law, nu)
    return {name: law.with_factors(_sharp_tip(law, nu, name) / neo_hooke) for name in FLESH_LAWS[1:]}


def _sharp_tip(law: DeepPair, poisson: float, flesh: FleshLawName = "neo-hooke") -> Floats:
    """Return the factors of large strain of a sharp tip at the depths of a curve [1]."""
    return np.array([large_strain_factor(depth, poisson, flesh) for depth in law.depths.tolist()])


def curve_contribution(law: DeepPair, samples: Samples, E: float) -> float:
    """Return the most that any curve within the error bars moves E [1]."""
    return law.curve_contributions(lambda curve: law.shift(samples, E, curve))


def _by_poisson(sensor: MeasuringUnit, law: DeepPair, samples: Samples, E: float) -> float:
    """Return the slope of ln E over nu [1] by the curve alone, over all nu that the fruit may have and that are solved.

    The curve is taken to move with nu as that of a sharp tip does.
    """
    fruit = sensor.design.fruit
    lowest = max(fruit.poisson - fruit.poisson_spread, 0.0)
    highest = min(max(fruit.poisson + fruit.poisson_spread, 0.0), LARGEST_POISSON)
    if lowest >= highest:
        return 0.0
    nominal = _sharp_tip(law, fruit.poisson)
    at_lowest = law.shift(samples, E, law.with_factors(_sharp_tip(law, lowest) / nominal))
    at_highest = law.shift(samples, E, law.with_factors(_sharp_tip(law, highest) / nominal))
    return (at_highest - at_lowest) / (highest - lowest)


def _sensitivity(sensor: MeasuringUnit, law: DeepPair, samples: Samples, E: float) -> Sensitivity:
    """Return the sensitivity of a modulus E [MPa] that is read of samples."""
    springs = []
    forces = []
    for tip in range(2):
        stiffer = replace(law, C=np.array(sensor.with_stiffness(tip, 1.0 + _STEP).C))
        gains = np.ones(2)
        gains[tip] += _STEP
        springs.append(law.shift(samples, E, stiffer) / _STEP)
        forces.append(law.shift(samples, E, law, gains) / _STEP)
    return Sensitivity(np.array(springs), np.array(forces))
