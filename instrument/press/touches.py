"""Split a signal into presses, each from the moment the last tip touches to the moment the first tip lifts off.

A sample is firm if the force of every tip exceeds twice the smallest force of a touch. A sample with a tip out of
contact between two firm samples is a bad conversion, not a lift. So noise does not end a press that has firm samples.
"""

import math
import operator
from array import array
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from instrument.press import press_core
from instrument.press.measuring import MeasuringUnit
from instrument.press.press_core import Unit
from instrument.press.relaxing_flesh import RelaxingFlesh
from instrument.press.signals import Sample
from instrument.press.spikes import FIRM, spike_constants
from sensor.arrays import Floats
from sensor.quantity import validation_error
from sensor.theory.relaxation import Relaxation

MAX_NAMED_LINES = 10  # maximum number of dropped samples whose lines a reading lists
MAX_SAMPLES = 1_000_000  # maximum number of samples of a press: after 3.5 hours at 80 Hz a lift must have been missed


@dataclass(frozen=True, kw_only=True, eq=False)
class PressSamples:
    """The samples of one press, without outliers.

    The first `tips` columns of `channels` (samples, channels) [N] are the forces of the tips. If the flesh relaxes, the
    next columns are the forces that elastic flesh would have at the same indentation. `t` (samples,) [s] are the
    sampling times, and `touched_s` [s] is the time of the first touch. All times are NaN if the log has no times.
    `lines_left_out` holds the line numbers of the first outliers. `fruit` is the name of the fruit in the file.
    """

    channels: Floats
    tips: int
    t: Floats
    touched_s: float
    lines_left_out: tuple[int, ...] = ()
    fruit: str = ""

    @classmethod
    def of_forces(cls, forces: Floats) -> "PressSamples":
        """Return a press with these `forces` (samples, tips) [N] but no times, on flesh that does not relax."""
        count, tips = forces.shape
        return cls(channels=forces, tips=tips, t=np.full(count, np.nan), touched_s=np.nan)

    @property
    def forces(self) -> Floats:
        """Return the forces of the tips [N], shape (samples, tips)."""
        return self.channels[:, : self.tips]

    @cached_property
    def deepest(self) -> int:
        """Return the index of the sample with the largest total force."""
        return int(self.forces.sum(axis=1).argmax())

    @property
    def duration_s(self) -> float | None:
        """Return the duration from the first touch to the deepest sample [s], or None if the log has no times."""
        duration = float(self.t[self.deepest]) - self.touched_s
        return duration if duration > 0.0 else None

    def is_firm(self, least_forces: Floats, spike_length: int) -> bool:
        """Return whether the press has more than `spike_length` consecutive firm samples.

        A sample is firm if the force of each tip exceeds `FIRM` times its smallest force in contact, `least_forces`
        (tips,) [N]. One bad conversion affects at most `spike_length` consecutive samples, so it cannot make a press
        firm.
        """
        firm = (self.forces > FIRM * least_forces).all(axis=1)
        # The convolution counts the firm samples in each run of spike_length + 1 samples.
        return bool(np.convolve(firm, np.ones(spike_length + 1)).max() > spike_length)


def split_presses(
    sensor: MeasuringUnit, samples: Iterable[Sample], source: str, spike_length: int, *, every_sample: bool = False
) -> Iterator[PressSamples]:
    """Yield each press of a signal when it ends. With `every_sample`, yield the unfinished press after each sample.

    The samples hold the forces of the tips [N]. `source` is the name of the signal in messages, and `spike_length` is
    the number of consecutive samples that one bad conversion affects. Raises InputError for a press of more than
    `MAX_SAMPLES` samples, and if the fruit changes within a press.
    """
    contact = _Contact(sensor)  # continues between the presses, unlike `touch`
    # The gains are 1, because the samples hold forces instead of channel readings.
    unit = Unit({**spike_constants(sensor), "gains": [1.0] * contact.tips, "spike_length": spike_length})
    touch: _Touch | None = None  # None between two presses
    for sample in samples:
        in_contact = contact.includes_all_tips(sample)
        if touch is None and not in_contact:
            contact.add(sample)
        if touch is not None and touch.has_ended(sample, in_contact=in_contact):
            yield from touch.end()
            # The samples of the lift do not belong to a press, but the flesh relaxes during them too.
            for lift_sample in touch.lift_samples:
                contact.add(lift_sample)
            touch = None
        if in_contact:
            touch = touch or _Touch(contact, unit, source, every_sample=every_sample)
            yield from touch.add(sample)
    if touch is not None:
        yield from touch.end()


class _Contact:
    """The contact of the tips with the fruit: when it began, and how the flesh has relaxed since."""

    def __init__(self, sensor: MeasuringUnit) -> None:
        relaxation = sensor.report.design.fruit.relaxation  # None if the flesh is elastic
        self._least_forces = sensor.least_forces.tolist()
        self._flesh = None if relaxation is None else RelaxingFlesh(Relaxation(relaxation), sensor.least_forces)
        self.tips = len(self._least_forces)
        self.touched_s = math.nan  # time of the first touch [s]
        self._smallest_total = math.inf  # smallest total force of this contact [N]; infinite before the first touch

    def includes_all_tips(self, sample: Sample) -> bool:
        """Return whether all tips touch the fruit in this sample."""
        return all(map(operator.gt, sample.forces, self._least_forces))

    def channels(self, sample: Sample) -> Iterable[float]:
        """Return the forces of the next sample [N], and for flesh that relaxes also the forces of elastic flesh [N].

        The flesh remembers the sample, so each sample must be passed only once.
        """
        if self._flesh is None:
            return sample.forces
        return self._flesh.channels(np.array(sample.forces), sample.t)

    def update_first_touch(self, sample: Sample) -> None:
        """Take the time of a sample as the first touch, if its total force is the smallest of this contact.

        The press begins at the smallest total force since the last sample without contact. It does not begin at the
        first force above zero, which may be a zero error due to the previous press.
        """
        total = sum(sample.forces)
        if not any(map(operator.gt, sample.forces, self._least_forces)):  # no tip touches, so the contact begins later
            self._smallest_total = math.inf
        elif total < self._smallest_total:
            self.touched_s, self._smallest_total = sample.t, total

    def end_press(self) -> None:
        """Let the next touch begin a new contact."""
        self._smallest_total = math.inf

    def add(self, sample: Sample) -> None:
        """Update the contact with a sample outside of a press."""
        self.update_first_touch(sample)
        self.channels(sample)


class _Touch:
    """A touch of all tips that has not ended, including samples that are neither accepted nor dropped yet."""

    def __init__(self, contact: _Contact, unit: Unit, source: str, *, every_sample: bool) -> None:
        """Prepare a touch without samples.

        `contact` converts the samples to channels. `unit` holds the constants by which outliers are found. `source` is
        the name of the signal in messages. With `every_sample`, the press up to each accepted sample is yielded instead
        of the whole press at its end.
        """
        self._contact = contact
        self._source = source
        self._every_sample = every_sample
        self._core = press_core.Touch(unit, self._take, self._drop)
        self._pending: dict[int, Sample] = {}  # samples that are neither accepted nor dropped yet, by their number
        self._accepted: list[Sample] = []  # samples accepted since the last call of `_store_accepted`
        self._lines_left_out: list[int] = []  # line numbers of the dropped samples
        self._fruit: str | None = None  # None before the first sample
        # The times and channels of all accepted samples; arrays of doubles need less memory than lists.
        self._t = array("d")
        self._channels = array("d")  # the channels of one sample after the other

    def add(self, sample: Sample) -> Iterator[PressSamples]:
        """Add a sample with all tips in contact; with `every_sample`, yield the press up to each newly accepted sample.

        Raises InputError if the fruit changes within a press, and for more than `MAX_SAMPLES` samples.
        """
        if self._fruit not in (None, sample.fruit):
            name = f"{self._source}, line {sample.line}: fruit"
            bound = f"{self._fruit!r} until the end of the press"
            raise validation_error(name, sample.fruit, "", bound, "lift the sensor between two fruits")
        self._fruit = sample.fruit
        self._pending[self._core.number + 1] = sample  # the number that the next call gives to this sample
        self._core.add(sample.forces)
        yield from self._store_accepted()

    def has_ended(self, sample: Sample, *, in_contact: bool) -> bool:
        """Return whether this sample shows that the touch has ended with a lift.

        `in_contact` states whether all tips touch. A sample with a tip out of contact is added to the touch, because
        only later samples show whether it is a part of a lift or a bad conversion.
        """
        if in_contact:
            return self._core.out_of_contact > 0 and not self._core.is_bad_conversion(sample.forces)
        self._pending[self._core.number + 1] = sample
        return self._core.add_out_of_contact(sample.forces)

    def end(self) -> Iterator[PressSamples]:
        """End the touch and yield the whole press; with `every_sample`, yield it up to each pending sample instead."""
        self._core.close()
        yield from self._store_accepted()
        self._contact.end_press()
        if not self._every_sample:
            yield self._press()

    @property
    def lift_samples(self) -> Iterable[Sample]:
        """Return the samples of the lift; call this after the touch has ended."""
        return self._pending.values()

    def _take(self, _: Sequence[float], number: int) -> None:
        self._accepted.append(self._pending.pop(number))

    def _drop(self, number: int) -> None:
        self._lines_left_out.append(self._pending.pop(number).line)

    def _store_accepted(self) -> Iterator[PressSamples]:
        """Store the accepted samples; with `every_sample`, yield the press after each of them.

        Raises InputError for more than `MAX_SAMPLES` samples.
        """
        newly_accepted, self._accepted = self._accepted, []
        for sample in newly_accepted:
            if not self._t:  # the first sample of the press
                self._contact.update_first_touch(sample)
            self._t.append(sample.t)
            self._channels.extend(self._contact.channels(sample))
            if len(self._t) > MAX_SAMPLES:
                name = f"{self._source}, line {sample.line}: samples of one press"
                hint = "lift the sensor after each press, and tare it"
                raise validation_error(name, len(self._t), "", f"at most {MAX_SAMPLES}", hint)
            if self._every_sample:
                yield self._press()

    def _press(self) -> PressSamples:
        """Return the press up to the last accepted sample."""
        return PressSamples(
            channels=np.array(self._channels).reshape(len(self._t), -1),
            tips=self._contact.tips,
            t=np.array(self._t),
            touched_s=self._contact.touched_s,
            lines_left_out=tuple(self._lines_left_out[:MAX_NAMED_LINES]),
            fruit=self._fruit or "",
        )
