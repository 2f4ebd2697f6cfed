"""From signals to readings: a press is the samples from the touch of the last tip to the lift of the first one."""

from collections.abc import Iterator, Sequence
from dataclasses import replace

from cad.quantity import InputError
from pipeline.measure.unit.fruit_reading import FruitReading, contrast_reading
from pipeline.measure.unit.measuring import MeasuringUnit
from pipeline.measure.unit.pair_press import PairPress, single_reading
from pipeline.measure.unit.signals import Sample, Signal

_CHECK_CHANNEL = "check zero, sign and unit of the channel"


def reading_of(sensor: MeasuringUnit, forces: Sequence[float]) -> FruitReading:
    """Return what one reading tells: forces [N] as the channels show them, in the order of the tips."""
    if sensor.law is not None:
        return contrast_reading(sensor, sensor.law, forces)
    return single_reading(sensor, [gain * force for gain, force in zip(sensor.unit.gain, forces, strict=True)])


def readings_of(sensor: MeasuringUnit, signal: Signal, *, every_sample: bool = False) -> Iterator[FruitReading]:
    """Yield one reading for each press of a signal as it ends, or one for each sample in which all tips touch.

    A signal without a press yields one reading, flagged as lifted off. Raises InputError at a line that is no sample.
    """
    press, pressed = _Press(sensor), False
    for sample in signal:
        forces = _checked(sensor, signal, sample)
        if all(force > least for force, least in zip(forces, sensor.least_forces, strict=True)):
            pressed = True
            press.add(sample, forces)
            if every_sample:
                yield press.reading_now(sample)
        elif press.count:
            if not every_sample:
                yield press.reading()
            press = _Press(sensor)
    if press.count and not every_sample:
        yield press.reading()
    if not pressed:
        yield FruitReading(flags=("lift_off",))


def _checked(sensor: MeasuringUnit, signal: Signal, sample: Sample) -> list[float]:
    """Return the forces of a sample [N]; raises InputError for one below zero or far beyond the sensor's scale."""
    forces = [gain * force for gain, force in zip(sensor.unit.gain, sample.forces, strict=True)]
    for tip, bound in _beyond_scale(sensor, forces):
        raise signal.fault_of_force(sample, tip, bound, _CHECK_CHANNEL)
    return forces


def refuse_bad_forces(sensor: MeasuringUnit, forces: Sequence[float]) -> None:
    """Raise InputError for forces [N] of `--forces` that are no numbers, below zero or far beyond the scale."""
    for tip, bound in _beyond_scale(sensor, forces):
        name = sensor.report.tips[tip].name
        msg = f"--forces: tip {name} = {forces[tip]:g} N: must be {bound}; {_CHECK_CHANNEL}"
        raise InputError(msg)


def _beyond_scale(sensor: MeasuringUnit, forces: Sequence[float]) -> Iterator[tuple[int, str]]:
    """Yield each tip whose force [N] is no number, below zero or far beyond the scale, and its bound in words."""
    for tip, force in enumerate(forces):
        least, largest = -sensor.least_forces[tip], sensor.largest_forces[tip]
        if not least <= force <= largest:
            yield tip, f"from {least:.3g} N, zero less its noise, to {largest:.3g} N, 20 full scales"


class _Press:
    """One press as it goes on: the line of a pair, or the deepest sample of another layout."""

    def __init__(self, sensor: MeasuringUnit) -> None:
        self.count = 0
        self._sensor = sensor
        self._pair = PairPress(sensor) if sensor.law is None else None
        self._deepest = 0.0
        self._sample: Sample | None = None

    def add(self, sample: Sample, forces: Sequence[float]) -> None:
        self.count += 1
        if self._pair is not None:
            soft, stiff = forces
            self._pair.add(soft, stiff, sample.x)
        if sum(forces) > self._deepest:
            self._deepest, self._sample = sum(forces), sample

    def reading(self) -> FruitReading:
        """Return what the press tells up to now, at the time of its deepest sample."""
        if self._sample is None:
            return FruitReading(flags=("lift_off",))
        if self._pair is not None:
            return replace(self._pair.reading(), t=self._sample.t)
        return replace(reading_of(self._sensor, self._sample.forces), t=self._sample.t)

    def reading_now(self, sample: Sample) -> FruitReading:
        """Return what a sample tells, for a pair the press up to it."""
        if self._pair is not None:
            return replace(self._pair.reading(), t=sample.t)
        return replace(reading_of(self._sensor, sample.forces), t=sample.t)
