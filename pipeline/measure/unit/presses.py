"""From signals to readings: a press is the samples from the touch of the last tip to the lift of the first one."""

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from cad.quantity import validation_error
from cad.theory.relaxation import Relaxation
from pipeline.measure.unit.fruit_reading import FruitReading, contrast_reading
from pipeline.measure.unit.measuring import MeasuringUnit
from pipeline.measure.unit.pair_press import PairPress, single_reading
from pipeline.measure.unit.signals import Sample, Signal

Floats = NDArray[np.float64]

TARE_SAMPLES = 10
"""Of a signal of counts, at its start, of a sensor that hangs free."""
_CHECK_CHANNEL = "check zero, sign and unit of the channel"


def reading_of(sensor: MeasuringUnit, channels: Sequence[float]) -> FruitReading:
    """Return what one reading tells: forces [N] as the channels show them, in the order of the tips."""
    forces = sensor.gained(channels)
    return single_reading(sensor, forces) if sensor.law is None else contrast_reading(sensor, sensor.law, forces)


def readings_of(sensor: MeasuringUnit, signal: Signal, *, every_sample: bool = False) -> Iterator[FruitReading]:
    """Yield one reading for each press of a signal as it ends, or one for each sample in which all tips touch.

    A signal without a press yields one reading, flagged as lifted off. Raises InputError at a line that is no sample.
    """
    press: _Press | None = None
    pressed = False
    samples = counted_in_newtons(sensor, signal) if signal.counted else signal
    for sample in samples:
        forces = sensor.gained(sample.forces)
        tip = _first_out_of_scale(sensor, forces)
        if tip is not None:
            raise signal.force_error(sample, tip, _scale_in_words(sensor, tip), _CHECK_CHANNEL)
        if (forces > sensor.least_forces).all():
            pressed = True
            press = press or _Press(sensor)
            press.add(sample, forces)
            if every_sample:
                yield press.reading(sample)
        elif press is not None:
            if not every_sample:
                yield press.reading(press.deepest)
            press = None
    if press is not None and not every_sample:
        yield press.reading(press.deepest)
    if not pressed:
        yield FruitReading(flags=("lift_off",))


def counted_in_newtons(sensor: MeasuringUnit, signal: Signal) -> Iterator[Sample]:
    """Yield the samples of a signal of counts with their forces [N]: its first ten, of a free sensor, are the tare.

    Raises InputError for a unit whose counts were not calibrated, for counts at the end of the converter's range, and
    for a tare that is no free sensor's: unsteady, or more than a full scale off that of the calibration.
    """
    unit = sensor.unit
    refuse_uncalibrated_counts(sensor, "FILE.csv")
    samples = iter(signal)
    free = list(itertools.islice(samples, TARE_SAMPLES))
    for sample in free:
        _refuse_saturation(sensor, signal, sample)
    tare = np.mean([sample.forces for sample in free], axis=0).tolist()
    hint = f"let the sensor hang free and still for the first {TARE_SAMPLES} samples"
    if len(free) < TARE_SAMPLES:
        raise signal.force_error(free[-1], 0, f"one of at least {TARE_SAMPLES} samples", hint, "counts")
    for sample in free:
        off = np.abs(unit.forces_of_counts(sample.forces, tare))
        if (off > sensor.least_forces).any():
            raise signal.force_error(sample, int((off - sensor.least_forces).argmax()), "steady", hint, "counts")
    moved = np.abs(unit.forces_of_counts(tare, unit.zero_counts))
    full_scale = np.array(sensor.report.read_out.full_scale_N)
    if (moved > full_scale).any():
        bound = "within a full scale of the calibration's zero"
        raise signal.force_error(free[0], int((moved / full_scale).argmax()), bound, hint, "counts")
    for sample in samples:
        _refuse_saturation(sensor, signal, sample)
        yield replace(sample, forces=unit.forces_of_counts(sample.forces, tare))


def refuse_uncalibrated_counts(sensor: MeasuringUnit, name: str) -> None:
    """Raise InputError for counts that a unit tells no forces of."""
    if not sensor.unit.newtons_per_count:
        bound = "forces, for the counts of this unit were not calibrated"
        raise validation_error(name, "counts", "", bound, "calibrate weights with counts, and give --unit")


def forces_of_counts(sensor: MeasuringUnit, counts: Sequence[float], tare: Sequence[float] | None) -> tuple[float, ...]:
    """Return the forces [N] of `--counts`, above a tare or the zero of the calibration; raises InputError."""
    refuse_uncalibrated_counts(sensor, "--counts")
    for values in (counts, tare or ()):
        for value in values:
            if abs(value) >= sensor.unit.saturation_counts:
                raise validation_error("--counts", value, "counts", _range_in_words(sensor), _CHECK_CHANNEL)
    return sensor.unit.forces_of_counts(counts, tare or sensor.unit.zero_counts)


def _refuse_saturation(sensor: MeasuringUnit, signal: Signal, sample: Sample) -> None:
    sizes = np.abs(sample.forces)
    if sizes.max() >= sensor.unit.saturation_counts:
        raise signal.force_error(sample, int(sizes.argmax()), _range_in_words(sensor), _CHECK_CHANNEL, "counts")


def _range_in_words(sensor: MeasuringUnit) -> str:
    return f"within +-{sensor.unit.saturation_counts}, the range of the converter"


def refuse_bad_forces(sensor: MeasuringUnit, forces: Sequence[float]) -> None:
    """Raise InputError for forces [N] of `--forces` that are below zero or far beyond the scale."""
    tip = _first_out_of_scale(sensor, np.array(forces))
    if tip is not None:
        name = f"--forces: tip {sensor.report.tips[tip].name}"
        raise validation_error(name, forces[tip], "N", _scale_in_words(sensor, tip), _CHECK_CHANNEL)


def _first_out_of_scale(sensor: MeasuringUnit, forces: Floats) -> int | None:
    in_scale = (-sensor.least_forces <= forces) & (forces <= sensor.largest_forces)
    return None if in_scale.all() else int(in_scale.argmin())


def _scale_in_words(sensor: MeasuringUnit, tip: int) -> str:
    lowest = -sensor.least_forces[tip]
    return f"from {lowest:.3g} N, zero less its noise, to {sensor.largest_forces[tip]:.3g} N, 20 full scales"


class _Press:
    """One press as it goes on: the samples of a pair, or the deepest sample of another layout."""

    def __init__(self, sensor: MeasuringUnit) -> None:
        self._sensor = sensor
        self._pair = PairPress(sensor)
        arms = sensor.design.fruit.relaxation
        self._relaxing = None
        if arms is not None:
            from pipeline.measure.unit.timed_reading import RelaxingPress  # loads SciPy, which few readings need

            self._relaxing = RelaxingPress(sensor, Relaxation(arms))
        self._largest = 0.0
        self.deepest = Sample(0, 0.0, None, ())

    def add(self, sample: Sample, forces: Floats) -> None:
        if self._sensor.law is None:
            low, high = forces.tolist()
            self._pair.add(low, high, sample.x)
        if self._relaxing is not None:
            self._relaxing.add(sample.t, forces)
        if forces.sum() > self._largest:  # above 0 from the first sample on
            self._largest = forces.sum()
            self.deepest = sample

    def reading(self, sample: Sample) -> FruitReading:
        """Return what a sample tells, for a pair the press up to now; of flesh that relaxes, the chosen moment."""
        if self._relaxing is not None:
            return replace(self._relaxing.reading(self._pair.reading()), t=sample.t)
        reading = self._pair.reading() if self._sensor.law is None else reading_of(self._sensor, sample.forces)
        return replace(reading, t=sample.t)
