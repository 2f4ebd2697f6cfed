"""Interpolate channels that are converted in turn to the time of the first conversion of each sample.

Each channel is interpolated linearly between two conversions. A sample before the first conversion of a channel is
dropped, because it cannot be interpolated.
"""

import itertools
import math
import statistics
from collections import deque
from collections.abc import Iterable, Iterator, Sequence
from functools import partial
from typing import NamedTuple

import numpy as np

from instrument.press.measuring import MeasuringUnit
from instrument.press.signals import Sample
from sensor.quantity import validation_error

MAX_LINES_APART = 64
"""Maximum number of lines between the earliest and the latest conversion of one line."""
FIRST_SAMPLES = 9
"""Number of samples at the start of a log whose median interval is taken as its sampling period."""
SHORTEST_INTERVAL = 0.9
"""Minimum interval of lines divided by the read-out's period [1]; the read-out may run faster than stated."""


class Timing(NamedTuple):
    """The accuracy of the channels' sampling times.

    `deviation` [s] is the standard deviation of the sampling time of each channel. Samples that are `lag` samples apart
    have independent noise, and one bad conversion affects `lag` consecutive samples.
    """

    deviation: float = 0.0
    lag: int = 1


def simultaneous_samples(
    sensor: MeasuringUnit, samples: Iterable[Sample], source: str
) -> tuple[Timing, Iterator[Sample]]:
    """Return samples whose channels are interpolated to one time, and the accuracy of this time.

    The log states one time per channel, or these times follow from the delays of the unit's read-out. Lines that arrive
    faster than the read-out converts come from another logger. They are not interpolated, because each channel may have
    been converted at any moment between two lines.

    `source` is the name of the log in messages. Raises InputError if the channels are delayed but the time does not
    increase from line to line. The iterator raises InputError if the times of one line are too many lines apart.
    """
    iterator = iter(samples)
    first_samples = list(itertools.islice(iterator, FIRST_SAMPLES))
    all_samples = itertools.chain(first_samples, iterator)
    if first_samples and first_samples[0].times:  # the log states one time per channel
        # An interpolated sample contains two conversions of a channel, so neighbouring samples share noise: lag 2.
        return Timing(lag=2), _interpolate_channels(all_samples, source)
    signal = sensor.report.read_out.signal
    if signal is None:  # a design without a read-out states no delays
        return Timing(), all_samples
    deviation = signal.time_deviation / signal.rate_Hz  # standard deviation of a sampling time [s]
    if not any(signal.delay_ms):  # all channels are converted at the same time
        return Timing(deviation), all_samples
    interval = _median_interval(first_samples, source)
    if interval < SHORTEST_INTERVAL * (1.0 / signal.rate_Hz):
        # The time of a conversion is distributed uniformly between two lines (JCGM 100:2008, 4.3.7).
        return Timing(max(deviation, interval / math.sqrt(12.0))), all_samples
    samples_with_times = map(partial(_with_channel_times, delays_ms=signal.delay_ms), all_samples)
    return Timing(deviation, lag=2), _interpolate_channels(samples_with_times, source)


def _with_channel_times(sample: Sample, delays_ms: Sequence[float]) -> Sample:
    """Return a copy of a sample with the time of each channel, which has a delay of `delays_ms` (channels,) [ms]."""
    return sample._replace(times=tuple(sample.t + 1e-3 * delay for delay in delays_ms))


def _median_interval(samples: Sequence[Sample], source: str) -> float:
    """Return the median time from sample to sample [s], or infinity for fewer than two samples.

    Raises InputError if the median is not above 0, because delayed channels cannot be interpolated then.
    """
    intervals = [after.t - before.t for before, after in itertools.pairwise(samples)]
    interval = statistics.median(intervals) if intervals else math.inf
    if not interval > 0.0:
        name = f"{source}: time from line to line"
        bound = "above 0 s, because the read-out converts the channels in turn"
        raise validation_error(name, interval, "s", bound, "write the time of each line")
    return interval


def _forces_at(t: float, samples: Sequence[Sample]) -> tuple[float, ...]:
    """Return the force of each channel [N] at the time `t` [s], interpolated linearly between its conversions.

    Each of the `samples` holds one force and one time per channel.
    """
    forces = []
    for channel in range(len(samples[0].forces)):
        times_of_channel = [sample.times[channel] for sample in samples]
        forces_of_channel = [sample.forces[channel] for sample in samples]
        forces.append(float(np.interp(t, times_of_channel, forces_of_channel)))
    return tuple(forces)


def _interpolate_channels(samples: Iterable[Sample], source: str) -> Iterator[Sample]:
    """Yield samples in which all channels are interpolated to the earliest time of the sample.

    Each of the `samples` holds one time per channel. The yielded samples hold only their common time `t`. A sample is
    dropped if a channel has no conversion at or before this time. Raises InputError if the times of one line lie more
    than `MAX_LINES_APART` lines apart.
    """
    window: deque[Sample] = deque()  # the last sample whose times are all at or before t, and all later samples
    for sample in samples:
        window.append(sample)
        t = min(sample.times)
        while len(window) > 1 and max(window[1].times) <= t:
            window.popleft()
        if max(window[0].times) <= t:  # each channel has a conversion at or before t, and one at or after t
            yield sample._replace(t=t, forces=_forces_at(t, window), times=())
        elif len(window) > MAX_LINES_APART:
            bound = f"less than {MAX_LINES_APART} lines"
            name = f"{source}, line {sample.line}: from the first time of a channel to the last"
            interval = max(sample.times) - t
            raise validation_error(name, interval, "s", bound, "write the conversions of one sample in one line")
