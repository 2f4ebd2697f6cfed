"""A press of a pair, sample by sample: the line over its seated part, with the force ratio and the stroke beside it.

A flat tip that is tilted touches with an edge first. It is seated, and the line is straight, once it is pressed in by
its side times the tilt (K. L. Johnson, Contact Mechanics, 1985, 5.2: a tilted punch stays whole while M / F < side/6).
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import reduce

import numpy as np

from cad.quantity import COVERAGE
from cad.theory.contrast_law import ReadingError
from cad.theory.pair_line import FEWEST, PairLine, PressSums, line_of_sums
from pipeline.measure.unit.deep_pair import Samples
from pipeline.measure.unit.deep_reading import deep_reading, deep_single_reading
from pipeline.measure.unit.fruit_reading import (
    LEVEL,
    FruitReading,
    Sensitivity,
    checked_reading,
    flags_of_forces,
    half_width,
    pair_pose,
    ratio_tilt_deviation,
)
from pipeline.measure.unit.measuring import MeasuringUnit

MOST_BLOCKS = 64
"""What is kept of a press of any length."""
_STEP = 1e-4  # of a stiffness, a gain or a force, for slopes of the modulus
_ROUNDS = 3  # of finding modulus and tilt, and leaving out what is not seated at them


class _Blocks:
    """Running sums over consecutive samples of two numbers, at most 64 of them: neighbours are joined as they fill."""

    def __init__(self) -> None:
        self._full: list[PressSums] = []
        self._open = PressSums()
        self._size = 1

    def add(self, low: float, high: float) -> None:
        self._open = self._open.joined(PressSums(1, low, high))
        if self._open.count < self._size:
            return
        self._full.append(self._open)
        self._open = PressSums()
        if len(self._full) == MOST_BLOCKS:
            self._full = [_joined(self._full[index : index + 2]) for index in range(0, MOST_BLOCKS, 2)]
            self._size *= 2

    def all(self) -> list[PressSums]:
        return [*self._full, self._open] if self._open.count else self._full


class PairPress:
    """The samples of one press of a unit, of whatever length, in a memory that does not grow."""

    def __init__(self, sensor: MeasuringUnit) -> None:
        """Begin a press."""
        self._sensor = sensor
        self._forces = _Blocks()
        self._strokes = _Blocks()

    def add(self, low: float, high: float, x: float | None = None) -> None:
        """Take the forces of both tips [N] in the next sample, and the travel x [mm] where it is measured."""
        self._forces.add(low, high)
        if x is not None:
            skin = self._sensor.report.contact.compliance_per_mm[-1]
            spring = self._sensor.C[-1]
            self._strokes.add(skin[0] * low + skin[1] * high, x - (spring[0] * low + spring[1] * high))

    def reading(self) -> FruitReading:
        """Return what the press tells: the modulus by the line, `others` by the force ratio and by the stroke.

        Samples after the deepest one are left out: on the way out a fruit gives back less than it took.
        """
        blocks = self._forces.all()
        if not blocks:
            return FruitReading(flags=("lift_off",))
        end = 1 + max(range(len(blocks)), key=lambda index: blocks[index].soft + blocks[index].stiff)
        blocks = blocks[:end]
        if self._sensor.deep is not None:
            counts = np.array([float(block.count) for block in blocks])
            forces = np.array([[block.soft, block.stiff] for block in blocks])
            return deep_reading(self._sensor, self._sensor.deep, Samples(counts, forces))
        reading = _line_reading(self._sensor, blocks)
        last = _joined(_last_third(self._strokes.all()[:end]))
        if last.count < FEWEST or not last.soft_stiff > 0.0:
            return reading
        # The high tip sinks by (S F) / E = x - (C F) less a constant: the slope of that over S F is 1 / E.
        return replace(reading, others={**reading.others, "stroke": last.soft_soft / last.soft_stiff})


def single_reading(sensor: MeasuringUnit, forces: Sequence[float]) -> FruitReading:
    """Return what one reading of a pair tells [N]: the force ratio, right only where no tilt leads one of its tips.

    The uncertainty holds the tilt that the design allows for.
    """
    if sensor.deep is not None:
        return deep_single_reading(sensor, sensor.deep, forces)
    flags = flags_of_forces(sensor, forces)
    if flags:
        return FruitReading(flags=flags)
    try:
        E = sensor.ratio_modulus(forces)
    except ReadingError:
        return FruitReading(flags=("out_of_range",))
    yielded = float(np.subtract(sensor.C[0], sensor.C[1]) @ forces)  # farther by the low spring than by the high one
    sensitivity = _ratio_sensitivity(sensor, forces)
    deviations = [sensitivity.by_noise(sensor, forces), ratio_tilt_deviation(sensor, yielded)]
    u = half_width(sensor, E, [*deviations, *sensitivity.by_unit(sensor)])
    return checked_reading(sensor, E, u, LEVEL, forces)


def _line_reading(sensor: MeasuringUnit, blocks: Sequence[PressSums]) -> FruitReading:
    deepest = [blocks[-1].soft, blocks[-1].stiff]
    try:
        sums = _seated(sensor, blocks)
        line = _line(sensor, sums)
    except ReadingError:
        return FruitReading(flags=("out_of_range",))

    def modulus(unit: MeasuringUnit, gains: Sequence[float]) -> float:
        return _line(unit, _with_gains(sums, *gains)).modulus

    u = half_width(sensor, line.modulus, [line.error, *_sensitivity(sensor, modulus).by_unit(sensor)])
    reading = checked_reading(sensor, line.modulus, u, pair_pose(sensor, line.lead), deepest)
    try:
        by_ratio = sensor.ratio_modulus(deepest)
        noise = _ratio_sensitivity(sensor, deepest).by_noise(sensor, deepest)
    except ReadingError:
        return reading.flagged("read_outs_disagree")
    reading = replace(reading, others={"force_ratio": by_ratio})
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
    if not sensor.design.tips.tip_shape.has_flat_face:
        return _joined(blocks)
    sums = _joined(_last_third(blocks))
    for _ in range(_ROUNDS):
        line = _line(sensor, sums)
        seated = [block for block in blocks if _is_seated(sensor, block, line)]
        sums = _joined(seated if len(seated) >= FEWEST else _last_third(blocks))
    return sums


def _is_seated(sensor: MeasuringUnit, block: PressSums, line: PairLine) -> bool:
    """Say whether both tips touch with their whole faces in a block, at the modulus and the tilt of a line."""
    S = sensor.report.contact.compliance_per_mm
    tips = sensor.design.tips
    roundness = 0.5 * tips.spacing_mm / sensor.design.fruit.radii_mm[0]
    slope = abs(line.lead) / tips.spacing_mm + roundness
    indentations = (S[0][0] * block.soft / line.modulus, S[1][1] * block.stiff / line.modulus)
    return min(indentations) >= tips.side_mm * slope


def _sensitivity(sensor: MeasuringUnit, read: Callable[[MeasuringUnit, Sequence[float]], float]) -> Sensitivity:
    """Return the sensitivity of the modulus that `read` gives for a unit, of forces that are larger by gains."""
    exact = (1.0, 1.0)
    E = read(sensor, exact)
    springs = []
    forces = []
    for tip in range(len(exact)):
        gains = list(exact)
        gains[tip] += _STEP
        springs.append((read(sensor.with_stiffness(tip, 1.0 + _STEP), exact) / E - 1.0) / _STEP)
        forces.append((read(sensor, gains) / E - 1.0) / _STEP)
    return Sensitivity(np.array(springs), np.array(forces))


def _ratio_sensitivity(sensor: MeasuringUnit, forces: Sequence[float]) -> Sensitivity:
    """Return the sensitivity of the modulus that the force ratio of forces [N] tells; raises ReadingError."""

    def modulus(unit: MeasuringUnit, gains: Sequence[float]) -> float:
        return unit.ratio_modulus(np.multiply(gains, forces).tolist())

    return _sensitivity(sensor, modulus)


def _with_gains(sums: PressSums, low: float, high: float) -> PressSums:
    """Return the sums of forces that are larger by gains [1]."""
    return PressSums(
        sums.count,
        low * sums.soft,
        high * sums.stiff,
        low * low * sums.soft_soft,
        low * high * sums.soft_stiff,
        high * high * sums.stiff_stiff,
    )
