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


def log_of(
    report: Report,
    unit: SimulatedUnit,
    presses: Sequence[PressCurve],
    rate: float,
    rng: np.random.Generator | None = None,
) -> list[str]:
    """Return the header and the lines of a log of consecutive presses, sampled at `rate` [Hz].

    If `rng` is given, the channels have noise, and the delays of their conversions have random errors. After the tare,
    each zero is shifted by the drift of the unit.
    """
    signal = report.read_out.signal
    tips = len(unit.heights)
    delays = np.zeros(tips)  # [s]
    if signal is not None and signal.delay_ms and rate * (1.0 / signal.rate_Hz) < 1.0 / SHORTEST_INTERVAL:
        delays = 1e-3 * np.array(signal.delay_ms)
    tare_s = max(TARE_S, TARE_SAMPLES / rate)
    starts, end = [], tare_s  # times at which the presses start and the log ends [s]
    for press in presses:
        starts.append(end)
        end += press.lasts_s + PAUSE_S
    t = np.arange(int(np.ceil(end * rate)) + 1) / rate
    conversion_times = t[:, None] + delays  # (samples, tips) [s]
    if rng is not None:
        delay_errors = rng.uniform(-1.0, 1.0, tips)
        if signal is not None:
            # The factor sqrt(3) turns the standard deviation of a uniform distribution into its half width.
            conversion_times = conversion_times + np.sqrt(3.0) * (signal.time_deviation / signal.rate_Hz) * delay_errors
    deflections = np.zeros((len(t), tips))
    for start, press in zip(starts, presses, strict=True):
        deflections += press.at(conversion_times - start)
    signals = unit.signals(deflections)
    if rng is not None:
        signals = signals + unit.noise * rng.normal(size=signals.shape)
    signals[t >= tare_s] += unit.zero_drift
    return _format_lines(unit, t, signals)


def _format_lines(unit: SimulatedUnit, t: Floats, signals: Floats) -> list[str]:
    """Return a header and one line per sample, from times [s] and signals (samples, tips) in newtons or counts."""
    tips = signals.shape[1]
    if unit.saturation is None:
        names = [f"{key}_N" for key in force_keys(tips)]
        cells = [[f"{value:.7g}" for value in row] for row in signals.tolist()]
    else:
        names = list(count_keys(tips))
        limit = unit.saturation
        cells = [[str(value) for value in row] for row in np.rint(signals).clip(-limit, limit).astype(int).tolist()]
    rows = [f"{time:.5f},{','.join(row)}" for time, row in zip(t.tolist(), cells, strict=True)]
    return [",".join(["t_s", *names]), *rows]
