"""Write simulated presses as a log in the format of a board's program: the time, and counts or newtons per channel."""

from collections.abc import Sequence

import numpy as np

from instrument.press.signals import count_keys, force_keys
from instrument.simulate.simulated_press import PressCurve
from instrument.simulate.unit import SimulatedUnit
from pipeline.report.report import Report
from sensor.arrays import Floats

TARE_S = 0.5
"""Minimum time before the first press [s], during which the sensor touches nothing."""
TARE_SAMPLES = 14
"""Minimum number of samples before the first press; ten of them are the tare."""
PAUSE_S = 1.0
"""Time from the end of a press to the next press [s]."""
SHORTEST_INTERVAL = 0.9
"""Minimum interval of samples divided by the read-out's period [1].

A faster log is assumed to come from another logger, whose channels are simultaneous.
"""


def usual_rate(report: Report) -> float:
    """Return the sampling rate of a design's read-out [Hz], or 20 Hz if the design has no read-out."""
    signal = report.read_out.signal
    return 20.0 if signal is None else signal.rate_Hz


def log_lines(
    report: Report,
    unit: SimulatedUnit,
    presses: Sequence[PressCurve],
    rate: float,
    rng: np.random.Generator | None = None,
) -> list[str]:
    """Return the header and the lines of a log of consecutive presses by a `unit`, sampled at `rate` [Hz].

    If `rng` is given, the channels have noise, and the delays of their conversions have random errors. Before the first
    press, the sensor touches nothing for the time of the tare. After the tare, each zero is shifted by the drift of the
    unit.
    """
    tips = len(unit.heights)
    tare_s = max(TARE_S, TARE_SAMPLES / rate)
    # The last time is the end of the log.
    *start_times, end = _start_times(presses, tare_s)
    t = np.arange(int(np.ceil(end * rate)) + 1) / rate  # times of the samples [s]
    conversion_times = _conversion_times(report, t, rate, rng)
    deflections = np.zeros((len(t), tips))
    for start, press in zip(start_times, presses, strict=True):
        deflections += press.at(conversion_times - start)  # 0 before and after the press
    signals = unit.signals(deflections)
    if rng is not None:
        signals = signals + unit.noise * rng.normal(size=signals.shape)
    signals[t >= tare_s] += unit.zero_drift
    return _format_lines(unit, t, signals)


def _start_times(presses: Sequence[PressCurve], first: float) -> list[float]:
    """Return the times [s] at which consecutive presses start, from the `first` [s], and at which one more would start.

    After each press there is a pause of `PAUSE_S`.
    """
    times = [first]
    for press in presses:
        times.append(times[-1] + (press.duration_s + PAUSE_S))
    return times


def _conversion_times(report: Report, t: Floats, rate: float, rng: np.random.Generator | None) -> Floats:
    """Return the time at which each channel of each sample is converted [s], shape (samples, tips).

    `t` (samples,) [s] are the times of the samples in a log of `rate` [Hz]. If `rng` is given, the delays have random
    errors. All samples of a channel have the same error.
    """
    times = t[:, None] + _conversion_delays(report, rate)
    if rng is None:
        return times
    # The errors are drawn even without a read-out, so that the random numbers of the noise do not depend on it.
    delay_errors = rng.uniform(-1.0, 1.0, len(report.tips))
    signal = report.read_out.signal
    if signal is None:
        return times
    deviation = signal.time_deviation / signal.rate_Hz  # standard deviation of the delay of a channel [s]
    # The factor sqrt(3) turns the standard deviation of a uniform distribution into its half width.
    return np.asarray(times + np.sqrt(3.0) * deviation * delay_errors)


def _conversion_delays(report: Report, rate: float) -> Floats:
    """Return the delay of each channel's conversion after the time of its sample [s], in a log of `rate` [Hz].

    The delays are 0 if the read-out converts all channels at once, or if the log is faster than the read-out.
    """
    signal = report.read_out.signal
    if signal is not None and signal.delay_ms and rate * (1.0 / signal.rate_Hz) < 1.0 / SHORTEST_INTERVAL:
        return 1e-3 * np.array(signal.delay_ms)
    return np.zeros(len(report.tips))


def _format_lines(unit: SimulatedUnit, t: Floats, signals: Floats) -> list[str]:
    """Return a header and one line per sample, from the times `t` (samples,) [s] and the `signals` (samples, tips).

    The signals are counts if the `unit` has counts, and newtons otherwise. Counts are rounded, and limited to the count
    at which the converter saturates.
    """
    tips = signals.shape[1]
    if unit.saturation is None:
        names = [f"{key}_N" for key in force_keys(tips)]
        cells = [[f"{value:.7g}" for value in row] for row in signals.tolist()]
    else:
        names = list(count_keys(tips))
        counts = np.rint(signals).clip(-unit.saturation, unit.saturation).astype(int)
        cells = [[str(count) for count in row] for row in counts.tolist()]
    rows = [f"{time:.5f},{','.join(row)}" for time, row in zip(t.tolist(), cells, strict=True)]
    return [",".join(["t_s", *names]), *rows]
