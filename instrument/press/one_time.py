"""Channels that are converted one after the other, interpolated to the time of the first conversion of each sample.

Between two conversions of a channel its value is taken to lie on a straight line. What lies before the first conversion
of a channel is left out, never extrapolated.
"""

import itertools
import math
import statistics
from collections import deque
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace

from instrument.press.signals import Sample
from sensor.quantity import validation_error

MOST_LINES = 64
"""The times of the channels of one line may lie so many lines apart; so many lines are kept."""
AHEAD = 9
"""Samples at the beginning of a log whose intervals tell its rate, by their median: one gap does not count."""
CLOSEST = 0.9  # of the time between two samples of the read-out, whose loop may be some per cent faster than told


class AtOneTime:
    """Samples whose channels have one time: by the times of a log, or by the delays of the read-out [s], (tips,).

    `deviation` [s] is the standard deviation of the time of each channel. It may differ from that of the read-out, as a
    log that has times tells them. Lines that come closer than the samples of the read-out are not its own. Their
    channels stay as they are, each converted at any moment between two lines. `lag` is from how many samples before
    noise is independent.
    """

    def __init__(
        self, samples: Iterable[Sample], source: str, delays: Sequence[float], deviation: float, period: float
    ) -> None:
        """Read the first samples; delays, deviation and the time between two samples [s] are of the read-out.

        Raises InputError where lines whose channels are delayed have all the same time.
        """
        ahead = list(itertools.islice(iterator := iter(samples), AHEAD))
        self._samples = itertools.chain(ahead, iterator)
        self._source = source
        self._timed = bool(ahead and ahead[0].times)
        by_delays = any(delays) and not self._timed
        intervals = [after.t - before.t for before, after in itertools.pairwise(ahead)]
        interval = statistics.median(intervals) if intervals else math.inf
        if by_delays and not interval > 0.0:
            name = f"{source}: time from line to line"
            bound = "above 0 s, for the read-out converts one channel after the other"
            raise validation_error(name, interval, "s", bound, "write the time of each line")
        closer = by_delays and interval < CLOSEST * period
        self._delays = delays if by_delays and not closer else ()
        self.deviation = deviation
        if self._timed:
            self.deviation = 0.0
        elif closer:  # a time anywhere between two lines (JCGM 100:2008, 4.3.7)
            self.deviation = max(deviation, interval / math.sqrt(12.0))
        self.lag = 2 if self._timed or self._delays else 1

    def __iter__(self) -> Iterator[Sample]:
        """Yield the samples; raises InputError where times of one line lie too many lines apart."""
        if not self._timed and not self._delays:
            yield from self._samples
            return
        rows: deque[Sample] = deque()
        for sample in self._samples:
            times = sample.times or tuple(sample.t + delay for delay in self._delays)
            rows.append(replace(sample, times=times))
            at = min(times)
            while len(rows) > 1 and max(rows[1].times) <= at:
                rows.popleft()
            if max(rows[0].times) <= at:
                yield _at(at, rows)
            elif len(rows) > MOST_LINES:
                apart = max(times) - at
                bound = f"less than {MOST_LINES} lines"
                name = f"{self._source}, line {sample.line}: from the first time of a channel to the last"
                raise validation_error(name, apart, "s", bound, "put conversions of one round in one line")


def _at(t: float, rows: Sequence[Sample]) -> Sample:
    """Return the last of some samples with all channels at a time [s]."""
    last = rows[-1]
    forces = [_between(t, [(row.times[tip], row.forces[tip]) for row in rows]) for tip in range(len(last.forces))]
    return replace(last, t=t, forces=tuple(forces), times=())


def _between(t: float, points: Sequence[tuple[float, float]]) -> float:
    """Return the value at a time on the straight line between the last point up to it and the next one, if any."""
    before = max((index for index, (at, _) in enumerate(points) if at <= t), default=0)
    start, value = points[before]
    if start >= t or before + 1 == len(points):
        return value
    end, later = points[before + 1]
    return later + (t - end) / (end - start) * (later - value)
