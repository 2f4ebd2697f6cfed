"""A press of a pair, sample by sample: the line over its seated part, with the force ratio and the stroke beside it.

A flat tip that is tilted touches with an edge first. It is seated, and the line is straight, once it is pressed in by
its side times the tilt (K. L. Johnson, Contact Mechanics, 1985, 5.2: a tilted punch stays whole while M / F < side/6).
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import reduce

import numpy as np

from cad.arrays import Floats
from cad.quantity import COVERAGE
from cad.theory.contrast_law import ReadingError
from cad.theory.pair_line import FEWEST, PairLine, PressSums, line_of_sums
from pipeline.measure.unit.fruit_reading import (
    FruitReading,
    Sensitivity,
    checked_reading,
    flags_of_forces,
    half_width,
)
from pipeline.measure.unit.measuring import MeasuringUnit

MOST_BLOCKS = 64
"""What is kept of a press of any length."""
_STEP = 1e-4  # of a stiffness, a gain or a force, for slopes of the modulus
_ROUNDS = 3  # of finding modulus and tilt, and leaving out what is not seated at them


class Blocks:
    """Running sums over consecutive samples of two numbers, at most 64 of them: neighbours are joined as they fill."""

    def __init__(self) -> None:
        """Begin without a sample."""
        self.sums: list[PressSums] = []
        self._size = 1

    def add(self, low: float, high: float) -> None:
        """Take the next sample."""
        if not self.sums or self.sums[-1].count == self._size:
            self.sums.append(PressSums())
        self.sums[-1] = self.sums[-1].joined(PressSums(1, low, high))
        if len(self.sums) == MOST_BLOCKS and self.sums[-1].count == self._size:
            self.sums = [first.joined(second) for first, second in zip(self.sums[::2], self.sums[1::2], strict=True)]
            self._size *= 2


class PairPress:
    """The samples of one press of a unit, of whatever length, in a memory that does not grow."""

    def __init__(self, sensor: MeasuringUnit) -> None:
        """Begin a press."""
        self._sensor = sensor
        self._forces = Blocks()
        self._strokes = Blocks()

    def add(self, forces: Floats, x: float | None = None) -> None:
        """Take the forces of both tips [N] in the next sample, and the travel x [mm] where it is measured."""
        low, high = forces.tolist()
        self._forces.add(low, high)
        if x is not None:
            skin = self._sensor.report.contact.compliance_per_mm[-1]
            spring = self._sensor.C[-1]
            self._strokes.add(skin[0] * low + skin[1] * high, x - (spring[0] * low + spring[1] * high))

    def reading(self) -> FruitReading:
        """Return what the press tells: the modulus by the line, `others` by the force ratio and by the stroke.

        Samples after the deepest one are left out: on the way out a fruit gives back less than it took.
        """
        blocks = self._forces.sums
        if not blocks:
            return FruitReading(flags=("lift_off",))
        end = 1 + int(np.argmax([block.soft + block.stiff for block in blocks]))
        blocks = blocks[:end]
        reading = _line_reading(self._sensor, blocks)
        strokes = _joined(_last_third(self._strokes.sums[:end]))
        if strokes.count < FEWEST or not strokes.soft_stiff > 0.0:
            return reading
        # The high tip sinks by (S F) / E = x - (C F) less a constant: the slope of that over S F is 1 / E.
        stroke = self._sensor.corrected(strokes.soft_soft / strokes.soft_stiff)
        return replace(reading, others={**reading.others, "stroke": stroke})


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
    yielded = float(np.subtract(sensor.C[0], sensor.C[1]) @ forces)  # farther by the low spring than by the high one
    sensitivity = ratio_sensitivity(sensor, forces)
    deviations = [sensitivity.by_noise(sensor, forces), sensor.ratio_tilt_deviation(yielded)]
    u = half_width(sensor, E, sensor.steepness(E), [*deviations, *sensitivity.by_unit(sensor)])
    return checked_reading(sensor, E, u, forces)


def _line_reading(sensor: MeasuringUnit, blocks: Sequence[PressSums]) -> FruitReading:
    deepest = np.array([blocks[-1].soft, blocks[-1].stiff])
    try:
        sums = _seated(sensor, blocks)
        line = _line(sensor, sums)
    except ReadingError:
        return FruitReading(flags=("out_of_range",))

    def modulus(unit: MeasuringUnit, low_gain: float, high_gain: float) -> float:
        """Return the modulus [MPa] that a unit reads of forces that are larger by gains [1]."""
        gained = PressSums(
            count=sums.count,
            soft=low_gain * sums.soft,
            stiff=high_gain * sums.stiff,
            soft_soft=low_gain**2 * sums.soft_soft,
            soft_stiff=low_gain * high_gain * sums.soft_stiff,
            stiff_stiff=high_gain**2 * sums.stiff_stiff,
        )
        return _line(unit, gained).modulus

    E = sensor.corrected(line.modulus)
    deviations = [line.error, *_sensitivity(sensor, modulus).by_unit(sensor)]
    u = half_width(sensor, E, sensor.steepness(E), deviations)
    reading = checked_reading(sensor, E, u, deepest, lead=line.lead)
    reading = reading.of_samples(sums.count, sensor.steepness(E) * line.error)
    try:
        by_ratio = sensor.ratio_modulus(deepest)
        noise = ratio_sensitivity(sensor, deepest).by_noise(sensor, deepest)
    except ReadingError:
        return reading.flagged("read_outs_disagree")
    reading = replace(reading, others={"force_ratio": sensor.corrected(by_ratio)})
    allowed = COVERAGE * math.hypot(noise, line.error) + sensor.model_error
    return reading.flagged("read_outs_disagree") if abs(by_ratio / line.modulus - 1.0) > allowed else reading


def _line(sensor: MeasuringUnit, sums: PressSums) -> PairLine:
    return line_of_sums(sensor.C, sensor.own_less_other, sums, sensor.noises.tolist())


def _last_third(blocks: Sequence[PressSums]) -> Sequence[PressSums]:
    """Return the end of a press, where tips are seated if they are anywhere."""
    return blocks[-max(FEWEST, len(blocks) // 3) :]


def _joined(blocks: Sequence[PressSums]) -> PressSums:
    return reduce(PressSums.joined, blocks, PressSums())


def _seated(sensor: MeasuringUnit, blocks: Sequence[PressSums]) -> PressSums:
    """Return the sums over the part of a press in which both tips touch with their whole faces; raises ReadingError."""
    tips = sensor.design.tips
    if not tips.tip_shape.has_flat_face:
        return _joined(blocks)
    S = sensor.report.contact.compliance_per_mm
    skin_slope = 0.5 * tips.spacing_mm / sensor.design.fruit.radii_mm[0]
    sums = _joined(_last_third(blocks))
    for _ in range(_ROUNDS):
        line = _line(sensor, sums)
        slope = abs(line.lead) / tips.spacing_mm + skin_slope
        least_depth = tips.side_mm * slope  # [mm] at which the whole face of a leaning tip has met the skin
        seated = []
        for block in blocks:
            if S[0][0] * block.soft / line.modulus < least_depth or S[1][1] * block.stiff / line.modulus < least_depth:
                continue
            seated.append(block)
        sums = _joined(seated if len(seated) >= FEWEST else _last_third(blocks))
    return sums


def ratio_sensitivity(sensor: MeasuringUnit, forces: Floats) -> Sensitivity:
    """Return the sensitivity of the modulus that the force ratio of forces [N] tells; raises ReadingError."""

    def modulus(unit: MeasuringUnit, low_gain: float, high_gain: float) -> float:
        return unit.ratio_modulus(forces * (low_gain, high_gain))

    return _sensitivity(sensor, modulus)


def _sensitivity(sensor: MeasuringUnit, read: Callable[[MeasuringUnit, float, float], float]) -> Sensitivity:
    """Return the sensitivity of the modulus that `read` gives for a unit and the gains of both forces."""
    more = 1.0 + _STEP
    moduli = [
        read(sensor.with_stiffness(0, more), 1.0, 1.0),
        read(sensor.with_stiffness(1, more), 1.0, 1.0),
        read(sensor, more, 1.0),
        read(sensor, 1.0, more),
    ]
    changes = (np.array(moduli) / read(sensor, 1.0, 1.0) - 1.0) / _STEP
    return Sensitivity(springs=changes[:2], forces=changes[2:])
