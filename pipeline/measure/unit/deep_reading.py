"""Readings of a pair whose tips go deep: the modulus by the curve of a tip at large strain, and what other laws read.

The curve is that of log neo-Hooke. The law of a real fruit is not known: what the laws of Hencky and of foam read of
the same forces stands beside, and in the uncertainty.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

from cad.quantity import COVERAGE
from cad.theory.contrast_law import ReadingError
from cad.theory.pair_line import PairLine
from cad.theory.soft_tissue import FLESH_LAWS, LARGEST_POISSON, large_strain_factor
from pipeline.measure.unit.deep_pair import TOO_DEEP, DeepPair, Sample
from pipeline.measure.unit.fruit_reading import FruitReading, combined, flags_of_forces, judged_reading
from pipeline.measure.unit.measuring import MeasuringUnit

_STEP = 1e-4  # of a stiffness or a gain, for slopes of the modulus
_EXACT = (1.0, 1.0)  # gains of both tips
_LEVEL = (None, None)  # tilt and its direction, which one reading of a pair does not tell


def deep_reading(sensor: MeasuringUnit, law: DeepPair, samples: Sequence[Sample]) -> FruitReading:
    """Return what the samples of a press tell: the modulus by the line, `others` by the force ratio and other laws."""
    _, *deepest = samples[-1]
    try:
        line = law.line(samples, sensor.noises)
        E, by_law, others = _with_others(sensor, law, lambda each: each.line(samples, sensor.noises).modulus)
    except ReadingError as error:
        return _without_modulus(error)
    by_curve = curve_share(law, samples, E)
    u = _half_width(sensor, law, samples, E, (line.error, by_curve, by_law))
    reading = judged_reading(sensor, E, u, _turned(sensor, line), deepest)
    ratio = _by_ratio(sensor, law, deepest)
    if ratio is None or abs(ratio[0] / E - 1.0) > _allowed_apart(sensor, by_curve, line.error, ratio[1]):
        reading = replace(reading, flags=(*reading.flags, "read_outs_disagree"))
    by_ratio = {} if ratio is None else {"force_ratio": ratio[0]}
    return _told(law, replace(reading, others={**by_ratio, **others}), deepest)


def _without_modulus(error: ReadingError) -> FruitReading:
    """Return a reading that tells no modulus, flagged where that is because the tips stand too deep."""
    deeper = ("deeper_than_solved",) if str(error) == TOO_DEEP else ()
    return FruitReading(flags=("out_of_range", *deeper))


def _by_ratio(sensor: MeasuringUnit, law: DeepPair, forces: Sequence[float]) -> tuple[float, float] | None:
    """Return the modulus [MPa] that the force ratio tells and its noise [1]; None where a tilt leaves it none."""
    try:
        ratio = law.ratio_modulus(forces)
    except ReadingError:
        return None
    return ratio, _noise(sensor, law, forces, ratio)


def _allowed_apart(sensor: MeasuringUnit, by_curve: float, *noises: float) -> float:
    """Return by how much line and force ratio may differ [1]: the bar of the curve, that of the contact, and noise."""
    return by_curve + 0.01 * sensor.report.read_out.model_error_percent + COVERAGE * math.hypot(*noises)


def deep_single_reading(sensor: MeasuringUnit, law: DeepPair, forces: Sequence[float]) -> FruitReading:
    """Return what one reading of a pair tells [N]: the force ratio, right only where no tilt leads one of its tips."""
    flags = flags_of_forces(sensor, forces)
    if flags:
        return FruitReading(flags=flags)
    try:
        E, by_law, others = _with_others(sensor, law, lambda each: each.ratio_modulus(forces))
    except ReadingError:
        return FruitReading(flags=("out_of_range",))
    samples = [(1, forces[0], forces[1])]
    scatter = math.hypot(_noise(sensor, law, forces, E), _by_lead(sensor, law, forces, E))
    u = _half_width(sensor, law, samples, E, (scatter, curve_share(law, samples, E), by_law))
    return _told(law, replace(judged_reading(sensor, E, u, _LEVEL, forces), others=others), forces)


def _half_width(
    sensor: MeasuringUnit, law: DeepPair, samples: Sequence[Sample], E: float, known: tuple[float, float, float]
) -> float:
    """Return the half width of E [1] by the standard deviation and the two bounds that are `known`, unit and nu."""
    scatter, *bounds = known
    scatter = math.hypot(scatter, *_unit_shares(sensor, law, samples, E))
    return combined(sensor, E, scatter, *bounds, curve_by_poisson=_by_poisson(sensor, law, samples, E))


def _by_lead(sensor: MeasuringUnit, law: DeepPair, forces: Sequence[float], E: float) -> float:
    """Return the standard deviation of the modulus [1] by a lead of either tip within the tilts of the design."""
    lead = math.tan(math.radians(sensor.steepest_deg)) * sensor.design.tips.spacing_mm
    return lead / (math.sqrt(3.0) * abs(law.lead_slopes(forces, E)[2]))


def _turned(sensor: MeasuringUnit, line: PairLine) -> tuple[float, float]:
    """Return the tilt that the lead of a line means, and its direction along the tips [deg]."""
    tilt = math.degrees(math.atan(-line.lead / sensor.design.tips.spacing_mm))
    return abs(tilt), 0.0 if tilt >= 0.0 else 180.0


def _with_others(
    sensor: MeasuringUnit, law: DeepPair, read: Callable[[DeepPair], float]
) -> tuple[float, float, dict[str, float]]:
    """Return the modulus [MPa], how far other laws move it [1], and what those read [MPa]."""
    E = read(law)
    others = {name: read(other) for name, other in other_laws(sensor, law)}
    by_law = max(abs(other / E - 1.0) for other in others.values())
    return E, by_law, others


def other_laws(sensor: MeasuringUnit, law: DeepPair) -> list[tuple[str, DeepPair]]:
    """Return the other laws of flesh by name: the curve times what they put a sharp tip's force apart."""
    nu = sensor.design.fruit.poisson
    found: list[tuple[str, DeepPair]] = []
    for name in FLESH_LAWS[1:]:
        apart = [large_strain_factor(d, nu, name) / large_strain_factor(d, nu) for d in law.depths]
        factors = tuple(factor * share for factor, share in zip(law.factors, apart, strict=True))
        found.append((name, replace(law, factors=factors)))
    return found


def curve_share(law: DeepPair, samples: Sequence[Sample], E: float) -> float:
    """Return the most that any curve within the error bars moves E [1]: the shares of all depths of the table added.

    A line tells slopes: a curve that bends within its bars moves E farther than one that is off alike everywhere.
    """
    return math.fsum(times * abs(law.moved(samples, E, other, _EXACT)) for other, times in law.perturbed())


def _by_poisson(sensor: MeasuringUnit, law: DeepPair, samples: Sequence[Sample], E: float) -> float:
    """Return the slope of ln E over nu [1] by the curve alone, over all nu that the fruit may have and that are solved.

    The curve is taken to move with nu as that of a sharp tip does.
    """
    fruit = sensor.design.fruit
    ends = [min(max(fruit.poisson + side * fruit.poisson_spread, 0.0), LARGEST_POISSON) for side in (-1.0, 1.0)]
    if ends[0] == ends[1]:
        return 0.0
    moved = []
    for nu in ends:
        shares = [large_strain_factor(d, nu) / large_strain_factor(d, fruit.poisson) for d in law.depths]
        factors = tuple(factor * share for factor, share in zip(law.factors, shares, strict=True))
        moved.append(law.moved(samples, E, replace(law, factors=factors), _EXACT))
    return (moved[1] - moved[0]) / (ends[1] - ends[0])


def _noise(sensor: MeasuringUnit, law: DeepPair, forces: Sequence[float], E: float) -> float:
    """Return the standard deviation of a modulus by the force ratio of one reading by noise alone [1]."""
    by_soft, by_stiff, by_modulus = law.lead_slopes(forces, E)
    return math.hypot(by_soft * sensor.noises[0], by_stiff * sensor.noises[1]) / abs(by_modulus)


def _unit_shares(sensor: MeasuringUnit, law: DeepPair, samples: Sequence[Sample], E: float) -> list[float]:
    """Return the share of E that each spring and each gain leaves open [1], one standard deviation."""
    unit, shares = sensor.unit, []
    for tip in range(len(unit.tips)):
        stiffer = replace(law, C=sensor.with_stiffness(tip, 1.0 + _STEP).C)
        gains = [1.0 + _STEP * (tip == other) for other in range(len(unit.tips))]
        by_spring = law.moved(samples, E, stiffer, [1.0] * len(gains)) / _STEP
        by_gain = law.moved(samples, E, law, gains) / _STEP
        shares += [0.01 * unit.K_percent[tip] * by_spring, 0.01 * unit.gain_percent[tip] * by_gain]
    return shares


def _told(law: DeepPair, reading: FruitReading, deepest: Sequence[float]) -> FruitReading:
    """Return a reading, flagged where a tip would stand deeper than large strain was solved for."""
    if reading.E is None or not law.is_beyond(deepest, reading.E):
        return reading
    return replace(reading, flags=(*reading.flags, "deeper_than_solved"))
