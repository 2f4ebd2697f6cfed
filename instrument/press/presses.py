"""From signals to readings: a press is the samples from the touch of the last tip to the lift of the first one."""

import itertools
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from instrument.press.contrast_press import ContrastPress
from instrument.press.count_codes import signed_counts
from instrument.press.first_touch import FirstTouch
from instrument.press.fruit_reading import ZERO_AFTER_S, FruitReading
from instrument.press.measuring import MeasuringUnit
from instrument.press.one_time import AtOneTime
from instrument.press.relaxing_flesh import Hold, RelaxingFlesh
from instrument.press.signals import Sample, Signal
from instrument.press.spikes import FIRM, SpikeFilter
from sensor.arrays import Floats
from sensor.quantity import validation_error
from sensor.theory.relaxation import Relaxation

TARE_SAMPLES = 10
"""Of a signal of counts, at its start, of a sensor that hangs free."""
MOST_NAMED = 10
"""Lines of a press that are named as left out; a stream may go on for ever."""


def readings_of(
    sensor: MeasuringUnit, signal: Signal, *, every_sample: bool = False, counts_as: str | None = None
) -> Iterator[FruitReading]:
    """Yield one reading for each press of a signal as it ends, or the press so far at each sample of it.

    `counts_as` is as in `signed_counts`. A signal without a press yields one reading, flagged as lifted off. Raises
    InputError at a line that is no sample, and for a line or a square whose report has no readings of whole presses.
    """
    sensor.refuse_without_rise_level()
    if signal.counted:
        tare, counts = tare_of(sensor, signal, counts_as)
        at_one_time = sensor_times(sensor, counts, signal.source)
        samples = counted_in_newtons(sensor, at_one_time, tare)
    else:
        at_one_time = sensor_times(sensor, signal, signal.source)
        samples = iter(at_one_time)
    touches = _Touches(sensor, at_one_time, every_sample=every_sample)
    spikes = SpikeFilter[Sample](sensor, at_one_time.lag)
    for sample, forces in spikes.filtered(_in_scale(sensor, signal, samples)):
        yield from touches.add(sample, forces, spikes.left_out)
    yield from touches.end(spikes.left_out)


def _in_scale(sensor: MeasuringUnit, signal: Signal, samples: Iterable[Sample]) -> Iterator[tuple[Sample, Floats]]:
    """Yield samples with the forces of their tips [N]; raises InputError as `refuse_out_of_scale`."""
    for sample in samples:
        forces = sensor.forces_of_channels(sample.forces)
        refuse_out_of_scale(sensor, forces, partial(signal.place, sample))
        yield sample, forces


def sensor_times(sensor: MeasuringUnit, samples: Iterable[Sample], source: str) -> AtOneTime:
    """Return samples whose channels have one time, by what the read-out of a unit tells of its times."""
    return AtOneTime(samples, source, sensor.delays_s, sensor.time_deviation_s, sensor.period_s)


def counted_in_newtons(sensor: MeasuringUnit, samples: Iterable[Sample], tare: Sequence[float]) -> Iterator[Sample]:
    """Yield samples of counts with their forces [N] above a tare."""
    for sample in samples:
        yield replace(sample, forces=sensor.unit.forces_of_counts(sample.forces, tare))


def tare_of(
    sensor: MeasuringUnit, signal: Signal, counts_as: str | None = None
) -> tuple[list[float], Iterator[Sample]]:
    """Return the tare of a signal of counts, its first ten samples, of a free sensor, and the samples behind them.

    Their counts are signed; `counts_as` is how those of the file are written, as in `signed_counts`.

    Raises InputError where counts were not calibrated, for counts at the end of the converter's range, and for a tare
    that is no free sensor's. Such a tare is unsteady, or more than a full scale off that of the calibration.
    """
    unit = sensor.unit
    if not unit.newtons_per_count:
        bound = "a record of forces: the counts of this unit are not calibrated"
        raise validation_error("FILE.csv", "counts", "", bound, "calibrate weights with counts, and give --unit")

    def signed(sample: Sample) -> Sample:
        counts = signed_counts(sample.forces, counts_as, unit.saturation_counts, partial(signal.place, sample))
        return replace(sample, forces=counts)

    samples = map(signed, signal)
    free = list(itertools.islice(samples, TARE_SAMPLES))
    hint = f"let the sensor hang free and still for the first {TARE_SAMPLES} samples"
    if len(free) < TARE_SAMPLES:
        raise validation_error(signal.place(free[-1], 0), len(free), "samples", f"at least {TARE_SAMPLES}", hint)
    tare = np.mean([sample.forces for sample in free], axis=0).tolist()
    off = np.abs(unit.forces_of_counts(tare, unit.zero_counts)) / sensor.report.read_out.full_scale_N
    if off.max() > 1.0:
        bound = "within a full scale of the calibration's zero"
        tip = int(off.argmax())
        raise validation_error(signal.place(free[0], tip), tare[tip], "counts", bound, hint)
    for sample in free:
        off = np.abs(unit.forces_of_counts(sample.forces, tare)) / sensor.least_forces
        if off.max() > 1.0:
            tip = int(off.argmax())
            raise validation_error(signal.place(sample, tip), sample.forces[tip], "counts", "steady", hint)
    return tare, samples


def refuse_out_of_scale(sensor: MeasuringUnit, forces: Sequence[float] | Floats, place: Callable[[int], str]) -> None:
    """Raise InputError, which names a tip by its place, for forces [N] below zero or far beyond the scale."""
    in_scale = sensor.in_scale(forces)
    if not in_scale.all():
        tip = int(in_scale.argmin())
        lowest = sensor.lowest_forces[tip]
        bound = f"from {lowest:.3g} N, zero less its noise, to {sensor.largest_forces[tip]:.3g} N, 20 full scales"
        hint = "check zero, sign and unit of the channel"
        raise validation_error(place(tip), float(forces[tip]), "N", bound, hint)


class _Touches:
    """The touches of a signal, of which those that are firm are presses."""

    def __init__(self, sensor: MeasuringUnit, at_one_time: AtOneTime, *, every_sample: bool) -> None:
        relaxation = sensor.design.fruit.relaxation
        self._sensor = sensor
        self._at_one_time = at_one_time
        self._every_sample = every_sample
        self._flesh = None if relaxation is None else RelaxingFlesh(Relaxation(relaxation), sensor.least_forces)
        self._press: _Press | None = None
        self._first = FirstTouch()
        self._hardly = FruitReading(flags=("lift_off",))
        self._told = False

    def add(self, sample: Sample, forces: Floats, left_out: list[Sample]) -> Iterator[FruitReading]:
        """Yield what a sample with its forces [N] ends or adds to; samples that were left out are taken."""
        del left_out[MOST_NAMED:]
        channels = forces if self._flesh is None else self._flesh.channels(forces, sample.t)
        touching = forces > self._sensor.least_forces
        if not touching.all():
            yield from self._ended(left_out)
        if self._press is None:
            self._first.add(sample.t, float(forces.sum()), touches=bool(touching.any()))
        if self._first.t is None or not touching.all():
            return
        self._press = self._press or _Press(self._sensor, self._at_one_time, self._first.t)
        self._press.add(sample, channels)
        if self._every_sample:
            self._told = True
            yield self._press.reading(left_out, sample.t)

    def end(self, left_out: list[Sample]) -> Iterator[FruitReading]:
        """Yield the press that the end of a signal ends; of a signal without one what its last touch tells."""
        yield from self._ended(left_out)
        if not self._told:
            yield self._hardly

    def _ended(self, left_out: list[Sample]) -> Iterator[FruitReading]:
        press, self._press = self._press, None
        if press is None:
            return
        self._first.look_anew()
        reading = press.reading(left_out)
        left_out.clear()
        if self._every_sample:
            return
        if press.is_firm:
            self._told = True
            yield press.with_zero_left(reading)
        else:
            self._hardly = reading


class _Press:
    """One press as it goes on."""

    def __init__(self, sensor: MeasuringUnit, at_one_time: AtOneTime, touched: float) -> None:
        """Begin with the first sample of all tips; the first of them touched at a time [s]."""
        self._sensor = sensor
        self._touched = touched
        self._t_last = touched
        hold = None if sensor.design.fruit.relaxation is None else Hold(sensor.design)
        self._press = ContrastPress(sensor, lag=at_one_time.lag, time_deviation_s=at_one_time.deviation, hold=hold)
        self._firm_forces = FIRM * sensor.least_forces
        self._several = at_one_time.lag
        self._firm_left = self._several + 1
        self._largest = 0.0
        self._deepest = np.zeros(len(sensor.least_forces))
        self._t_deepest = touched

    @property
    def is_firm(self) -> bool:
        """Say whether more samples in a row than one bad conversion is part of had a force that noise does not end."""
        return self._firm_left <= 0

    def add(self, sample: Sample, channels: Floats) -> None:
        """Take a sample with its channels [N], the forces of all tips first."""
        self._press.add(channels, sample.t)
        forces = channels[: len(sample.forces)]
        if not self.is_firm:
            is_firm = bool((forces > self._firm_forces).all())
            self._firm_left = self._firm_left - 1 if is_firm else self._several + 1
        whole = float(forces.sum())
        if whole > self._largest:  # above 0 from the first sample on
            self._largest = whole
            self._deepest = forces
            self._t_deepest = sample.t
        self._t_last = sample.t

    @property
    def _duration(self) -> float | None:
        """Return the duration from the first touch to the deepest sample [s]; None where times do not tell it."""
        return self._t_deepest - self._touched or None

    def with_zero_left(self, reading: FruitReading) -> FruitReading:
        """Return the reading of a press that has ended with the zero that it leaves, where the springs creep."""
        creep = self._sensor.creep
        if creep.exponent == 0.0 or self._duration is None:
            return reading
        share = creep.left_behind(ZERO_AFTER_S, self._duration, self._t_last - self._touched)
        of_touch = share * self._deepest / self._sensor.least_forces
        tip = int(of_touch.argmax())
        return replace(reading, zero_left=share * float(self._deepest[tip]), zero_left_of_touch=float(of_touch[tip]))

    def reading(self, left_out: Sequence[Sample], t: float | None = None) -> FruitReading:
        """Return what the press tells so far, at a time [s], or at that of its deepest sample."""
        reading = replace(self._press.reading(self._duration), t=self._t_deepest if t is None else t)
        lines = tuple(sample.line for sample in left_out)
        return reading.with_flag("spike").without_lines(lines) if lines else reading
