"""A press of a pair, sample by sample: the line over its seated part, with the force ratio and the stroke beside it.

A flat tip that is tilted touches with an edge first. It is seated, and the line is straight, once it is pressed in by
its side times the tilt (K. L. Johnson, Contact Mechanics, 1985, 5.2: a tilted punch stays whole while M / F < side/6).
"""

import math
from collections.abc import Sequence
from dataclasses import replace

from cad.quantity import COVERAGE
from cad.theory.contrast_law import ReadingError
from cad.theory.pair_line import FEWEST, PairLine, PressSums, line_of_sums, ratio_modulus
from pipeline.measure.unit.deep_reading import deep_reading, deep_single_reading
from pipeline.measure.unit.fruit_reading import (
    FruitReading,
    combined,
    flags_of_forces,
    judged_reading,
)
from pipeline.measure.unit.measuring import MeasuringUnit

MOST_BLOCKS = 64  # what is kept of a press of any length
_STEP = 1e-4  # of a stiffness or a gain, for slopes of the modulus
_ROUNDS = 3  # of finding modulus and tilt, and leaving out what is not seated at them


class _Blocks:
    """Running sums over consecutive samples of two numbers, at most 64 of them: neighbours are joined as they fill."""

    def __init__(self) -> None:
        self.sums: list[PressSums] = []
        self._open = PressSums()
        self._size = 1

    def add(self, one: float, other: float) -> None:
        self._open = self._open.joined(PressSums(1, one, other))
        if self._open.count < self._size:
            return
        self.sums.append(self._open)
        self._open = PressSums()
        if len(self.sums) == MOST_BLOCKS:
            pairs = zip(self.sums[::2], self.sums[1::2], strict=True)
            self.sums = [first.joined(second) for first, second in pairs]
            self._size *= 2

    def all(self) -> list[PressSums]:
        return [*self.sums, self._open] if self._open.count else self.sums


class PairPress:
    """The samples of one press of a unit, of whatever length, in a memory that does not grow."""

    def __init__(self, sensor: MeasuringUnit) -> None:
        """Begin a press."""
        self._sensor = sensor
        self._forces, self._strokes = _Blocks(), _Blocks()

    def add(self, soft: float, stiff: float, x: float | None = None) -> None:
        """Take the forces of both tips [N] in the next sample, and the travel x [mm] where it is measured."""
        self._forces.add(soft, stiff)
        if x is not None:
            sunk, given = (
                table[-1][0] * soft + table[-1][1] * stiff
                for table in (self._sensor.report.contact.compliance_per_mm, self._sensor.C)
            )
            self._strokes.add(sunk, x - given)

    def reading(self) -> FruitReading:
        """Return what the press tells: the modulus by the line, `others` by the force ratio and by the stroke.

        Samples after the deepest one are left out: on the way out a fruit gives back less than it took.
        """
        blocks = self._forces.all()
        if not blocks:
            return FruitReading(flags=("lift_off",))
        deepest = max(range(len(blocks)), key=lambda place: blocks[place].soft + blocks[place].stiff) + 1
        if self._sensor.deep is not None:
            samples = [(block.count, block.soft, block.stiff) for block in blocks[:deepest]]
            return deep_reading(self._sensor, self._sensor.deep, samples)
        reading = _line_reading(self._sensor, blocks[:deepest])
        last = _joined(_last(self._strokes.all()[:deepest]))
        if last.count < FEWEST or not last.soft_stiff > 0.0:
            return reading
        # The stiff tip sinks by (S F) / E = x - (C F) less a constant: the slope of that over S F is 1 / E.
        return replace(reading, others={**reading.others, "stroke": last.soft_soft / last.soft_stiff})


def _line_reading(sensor: MeasuringUnit, blocks: Sequence[PressSums]) -> FruitReading:
    deepest = [blocks[-1].soft, blocks[-1].stiff]
    try:
        sums, line = _seated_line(sensor, blocks)
    except ReadingError:
        return FruitReading(flags=("out_of_range",))
    E, tilt = line.modulus, _tilt(sensor, line)
    scatter = math.hypot(line.error, *_unit_shares(sensor, sums))
    turned = abs(tilt), 0.0 if tilt >= 0.0 else 180.0
    reading = judged_reading(sensor, E, combined(sensor, E, scatter), turned, deepest)
    return _with_ratio(sensor, reading, line, deepest)


def _last(blocks: Sequence[PressSums]) -> list[PressSums]:
    """Return the last third of the blocks of a press, where tips are seated if they are anywhere."""
    return list(blocks[-max(FEWEST, len(blocks) // 3) :])


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
        E = _ratio(sensor, forces)
    except ReadingError:
        return FruitReading(flags=("out_of_range",))
    sums = PressSums(FEWEST, forces[0], forces[1])
    lead = math.tan(math.radians(sensor.steepest_deg)) * sensor.design.tips.spacing_mm
    give = _give(sensor, forces)
    scatter = math.hypot(
        _ratio_noise(sensor, forces), lead / (math.sqrt(3.0) * give), *_unit_shares(sensor, sums, ratio=True)
    )
    return judged_reading(sensor, E, combined(sensor, E, scatter), (None, None), forces)


def _ratio(sensor: MeasuringUnit, forces: Sequence[float]) -> float:
    return ratio_modulus(sensor.C, sensor.report.read_out.own_less_other_per_mm or 0.0, forces)


def _give(sensor: MeasuringUnit, forces: Sequence[float]) -> float:
    """Return how much farther the spring of the low tip gives than that of the high one [mm]."""
    (a, b), (c, d) = sensor.C
    return (a - c) * forces[0] + (b - d) * forces[1]


def _line(sensor: MeasuringUnit, sums: PressSums) -> PairLine:
    return line_of_sums(sensor.C, sensor.report.read_out.own_less_other_per_mm or 0.0, sums, sensor.noises)


def _seated_line(sensor: MeasuringUnit, blocks: Sequence[PressSums]) -> tuple[PressSums, PairLine]:
    """Return the sums over the seated part of a press and its line; raises ReadingError."""
    if not sensor.design.tips.tip_shape.has_flat_face:
        sums = _joined(blocks)
        return sums, _line(sensor, sums)
    last = _last(blocks)
    line = _line(sensor, _joined(last))
    for _ in range(_ROUNDS):
        seated = [block for block in blocks if _is_seated(sensor, block, line)]
        sums = _joined(seated if len(seated) >= FEWEST else last)
        line = _line(sensor, sums)
    return sums, line


def _is_seated(sensor: MeasuringUnit, block: PressSums, line: PairLine) -> bool:
    """Say whether both tips touch with their whole faces in a block, at the modulus and the tilt of a line."""
    S, tips = sensor.report.contact.compliance_per_mm, sensor.design.tips
    half_way = 0.5 * tips.spacing_mm / sensor.design.fruit.radii_mm[0]
    slope = abs(math.tan(math.radians(_tilt(sensor, line)))) + half_way
    forces = block.soft, block.stiff
    return all(S[tip][tip] * force / line.modulus >= tips.side_mm * slope for tip, force in enumerate(forces))


def _joined(blocks: Sequence[PressSums]) -> PressSums:
    sums = PressSums()
    for block in blocks:
        sums = sums.joined(block)
    return sums


def _tilt(sensor: MeasuringUnit, line: PairLine) -> float:
    """Return the tilt [deg] that a lead means; a positive one lowers the high tip, as press.tilt_deg does."""
    return math.degrees(math.atan(-line.lead / sensor.design.tips.spacing_mm))


def _unit_shares(sensor: MeasuringUnit, sums: PressSums, *, ratio: bool = False) -> list[float]:
    """Return the share of E that each spring and each gain leaves open [1], one standard deviation."""

    def read(changed: MeasuringUnit, gains: Sequence[float]) -> float:
        scaled = _gained(sums, *gains)
        return _ratio(changed, (scaled.soft, scaled.stiff)) if ratio else _line(changed, scaled).modulus

    unit, shares = sensor.unit, []
    alike = [1.0] * len(unit.tips)
    E = read(sensor, alike)
    for tip in range(len(unit.tips)):
        gains = [1.0 + _STEP * (tip == other) for other in range(len(unit.tips))]
        stiffer = read(sensor.with_stiffness(tip, 1.0 + _STEP), alike) / E - 1.0
        gained = read(sensor, gains) / E - 1.0
        shares += [0.01 * unit.K_percent[tip] * stiffer / _STEP, 0.01 * unit.gain_percent[tip] * gained / _STEP]
    return shares


def _gained(sums: PressSums, soft: float, stiff: float) -> PressSums:
    """Return the sums of forces that are larger by gains [1]."""
    return PressSums(
        sums.count,
        soft * sums.soft,
        stiff * sums.stiff,
        soft * soft * sums.soft_soft,
        soft * stiff * sums.soft_stiff,
        stiff * stiff * sums.stiff_stiff,
    )


def _ratio_noise(sensor: MeasuringUnit, forces: Sequence[float]) -> float:
    """Return the standard deviation of a modulus by the force ratio of one reading by noise alone [1]."""
    E = _ratio(sensor, forces)
    moved = []
    for tip, noise in enumerate(sensor.noises):
        step = _STEP * forces[tip]
        other = [force + step * (tip == place) for place, force in enumerate(forces)]
        moved.append((_ratio(sensor, other) / E - 1.0) / step * noise)
    return math.hypot(*moved)


def _with_ratio(sensor: MeasuringUnit, reading: FruitReading, line: PairLine, deepest: Sequence[float]) -> FruitReading:
    """Return a reading with what the force ratio gives, flagged where noise does not explain how they differ."""
    try:
        ratio, noise = _ratio(sensor, deepest), _ratio_noise(sensor, deepest)
    except ReadingError:
        return replace(reading, flags=(*reading.flags, "read_outs_disagree"))
    allowed = COVERAGE * math.hypot(noise, line.error) + 0.01 * sensor.report.read_out.model_error_percent
    apart = abs(ratio / line.modulus - 1.0) > allowed
    flags = (*reading.flags, *(["read_outs_disagree"] if apart else []))
    return replace(reading, flags=flags, others={"force_ratio": ratio})
