"""Samples of a signal are cut into presses, each from the touch of the last tip to the lift of the first one.

A tip may be out of contact in one sample between two samples with twice the least force of a touch. Such a sample is a
bad conversion, not a lift. Once all tips had twice the least force, a press is firm, and noise does not end it.
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

MOST_NAMED = 10  # most lines of dropped samples that a reading names
MOST_SAMPLES = 1_000_000  # most samples of a press: 3.5 hours at 80 Hz, so no tip was lifted


@dataclass(frozen=True, kw_only=True, eq=False)
class PressSamples:
    """The samples of one press, without those that contradict the others.

    `channels` (samples, channels) [N] begin with the forces of the `tips`. The forces of the same deflections of
    elastic flesh follow if the flesh relaxes. `t` (samples,) [s] are the times of the samples and `touched_s` [s] is
    the time of the first touch. All times are nan if the log has none. `lines_left_out` names the first lines of
    samples that contradict the press. `fruit` is the name of the fruit in the file.
    """

    channels: Floats
    tips: int
    t: Floats
    touched_s: float
    lines_left_out: tuple[int, ...] = ()
    fruit: str = ""

    @classmethod
    def of_forces(cls, forces: Floats) -> "PressSamples":
        """Return a press of forces [N], shape (samples, tips), without times."""
        count, tips = forces.shape
        return cls(channels=forces, tips=tips, t=np.full(count, np.nan), touched_s=np.nan)

    @property
    def forces(self) -> Floats:
        """Return the forces of the tips [N], shape (samples, tips)."""
        return self.channels[:, : self.tips]

    @cached_property
    def deepest(self) -> int:
        """Return the index of the sample with the largest whole force."""
        return int(self.forces.sum(axis=1).argmax())

    @property
    def duration_s(self) -> float | None:
        """Return the duration from the first touch to the deepest sample [s], or None if the log has no times."""
        duration = float(self.t[self.deepest]) - self.touched_s
        return duration if duration > 0.0 else None

    def is_firm(self, least_forces: Floats, several: int) -> bool:
        """Return whether more than `several` samples in a row are firm; a bad conversion affects `several` samples."""
        firm = (self.forces > FIRM * least_forces).all(axis=1)
        return bool(np.convolve(firm, np.ones(several + 1)).max() > several)


def presses_of(
    sensor: MeasuringUnit, samples: Iterable[Sample], source: str, several: int, *, growing: bool = False
) -> Iterator[PressSamples]:
    """Yield each press of a signal as it ends, or with `growing` the press up to each of its samples.

    The samples hold the forces of the tips [N]. `several` is the number of consecutive samples that a bad conversion
    affects. Raises InputError for a press that never ends.
    """
    contact = _Contact(sensor)
    unit = Unit({**spike_constants(sensor), "gains": [1.0] * contact.tips, "several": several})
    touch: _Touch | None = None
    for sample in samples:
        touches = contact.touches(sample)
        if touch is not None and (touch.is_over(sample) if touches else touch.lifts(sample)):
            yield from touch.end()
            for each in touch.lifted:
                contact.add(each)
            touch = None
        elif touch is None and not touches:
            contact.add(sample)
        if touches:
            touch = touch or _Touch(contact, unit, source, growing=growing)
            yield from touch.add(sample)
    if touch is not None:
        yield from touch.end()


def _all_above(forces: Sequence[float], bounds: Sequence[float]) -> bool:
    return all(map(operator.gt, forces, bounds))


class _Contact:
    """The contact of the tips with the fruit: when it began, and the memory of flesh that relaxes."""

    def __init__(self, sensor: MeasuringUnit) -> None:
        """Begin without a contact."""
        relaxation = sensor.report.design.fruit.relaxation
        self._least = sensor.least_forces.tolist()
        self._flesh = None if relaxation is None else RelaxingFlesh(Relaxation(relaxation), sensor.least_forces)
        self.tips = len(self._least)
        self.touched_s = math.nan
        self._least_whole = math.inf

    def touches(self, sample: Sample) -> bool:
        """Return whether all tips touch."""
        return _all_above(sample.forces, self._least)

    def channels(self, sample: Sample) -> Iterable[float]:
        """Return the forces of the next sample [N]; for flesh that relaxes, the forces of elastic flesh follow."""
        if self._flesh is None:
            return sample.forces
        return self._flesh.channels(np.array(sample.forces), sample.t)

    def begin_press(self, sample: Sample) -> None:
        """Note the time of a sample at or before the begin of a press, if its whole force is the least of this contact.

        A press begins at the least whole force since no tip touched. The first force above zero may be a zero error
        that the press before has left.
        """
        whole = sum(sample.forces)
        if not any(map(operator.gt, sample.forces, self._least)):
            self._least_whole = math.inf
        elif whole < self._least_whole:
            self.touched_s, self._least_whole = sample.t, whole

    def end_press(self) -> None:
        """Begin a new contact with the next touch."""
        self._least_whole = math.inf

    def add(self, sample: Sample) -> None:
        """Process a sample outside of a press."""
        self.begin_press(sample)
        self.channels(sample)


class _Touch:
    """A running touch of all tips."""

    def __init__(self, contact: _Contact, unit: Unit, source: str, *, growing: bool) -> None:
        """Begin with no sample."""
        self._contact = contact
        self._source = source
        self._growing = growing
        self._row = press_core.Touch(unit, self._take, self._drop)
        self._waiting: dict[int, Sample] = {}  # by sample number
        self._taken: list[Sample] = []
        self._lines_left_out: list[int] = []
        self._fruit: str | None = None
        self._t = array("d")
        self._channels = array("d")

    def add(self, sample: Sample) -> Iterator[PressSamples]:
        """Add a sample with all tips in contact; if the press is growing, yield the press up to each decided sample.

        Raises InputError if the fruit changes within a press.
        """
        if self._fruit not in (None, sample.fruit):
            name = f"{self._source}, line {sample.line}: fruit"
            bound = f"{self._fruit!r} to the end of its press"
            raise validation_error(name, sample.fruit, "", bound, "lift the sensor between two fruits")
        self._fruit = sample.fruit
        self._waiting[self._row.number + 1] = sample
        self._row.add(sample.forces)
        yield from self._passed_on()

    def lifts(self, sample: Sample) -> bool:
        """Add a sample with a tip out of contact; return whether this is a lift."""
        self._waiting[self._row.number + 1] = sample
        return self._row.lifts(sample.forces)

    def is_over(self, sample: Sample) -> bool:
        """Return whether the samples out of contact before a touch were a lift, not bad conversions."""
        return self._row.off > 0 and not self._row.lost(sample.forces)

    def end(self) -> Iterator[PressSamples]:
        """End the touch: yield what is still pending, or the whole press."""
        self._row.close()
        yield from self._passed_on()
        self._contact.end_press()
        if not self._growing:
            yield self._press()

    @property
    def lifted(self) -> Iterable[Sample]:
        """Return the samples of the lift, after the touch has ended."""
        return self._waiting.values()

    def _take(self, _: Sequence[float], number: int) -> None:
        self._taken.append(self._waiting.pop(number))

    def _drop(self, number: int) -> None:
        self._lines_left_out.append(self._waiting.pop(number).line)

    def _passed_on(self) -> Iterator[PressSamples]:
        """Store the accepted samples; if the press is growing, yield it after each of them."""
        taken, self._taken = self._taken, []
        for sample in taken:
            if not self._t:
                self._contact.begin_press(sample)
            self._t.append(sample.t)
            self._channels.extend(self._contact.channels(sample))
            if len(self._t) > MOST_SAMPLES:
                name = f"{self._source}, line {sample.line}: samples of one press"
                hint = "lift the sensor after each press, and tare it"
                raise validation_error(name, len(self._t), "", f"at most {MOST_SAMPLES}", hint)
            if self._growing:
                yield self._press()

    def _press(self) -> PressSamples:
        """Return the press of all stored samples."""
        return PressSamples(
            channels=np.array(self._channels).reshape(len(self._t), -1),
            tips=self._contact.tips,
            t=np.array(self._t),
            touched_s=self._contact.touched_s,
            lines_left_out=tuple(self._lines_left_out[:MOST_NAMED]),
            fruit=self._fruit or "",
        )
