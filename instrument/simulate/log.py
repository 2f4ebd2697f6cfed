"""The log of presses in the format of a unit's program: time, and counts or newtons of each channel."""

from collections.abc import Sequence

import numpy as np

from instrument.press.signals import count_keys, force_keys
from instrument.simulate.simulated_press import PressCurve
from instrument.simulate.unit import SimulatedUnit
from pipeline.report.report import Report
from sensor.arrays import Floats

TARE_S = 0.5
TARE_SAMPLES = 14
"""Least number of samples of the free sensor before the first press; the tare takes ten."""
PAUSE_S = 1.0
AT_ONCE = 0.9  # share of the read-out's period; a faster log comes from elsewhere, and its channels have one time


def usual_rate(report: Report) -> float:
    """Return the rate of the read-out of a design [Hz], 20 Hz if it has none."""
    signal = report.read_out.signal
    return 20.0 if signal is None else signal.rate_Hz


def log_of(
    report: Report,
    unit: SimulatedUnit,
    presses: Sequence[PressCurve],
    rate: float,
    rng: np.random.Generator | None = None,
) -> list[str]:
    """Return the lines of a log of presses at a rate [Hz], with its header.

    With a random generator, channels have noise, conversion times scatter, and zeros drift after the tare.
    """
    signal = report.read_out.signal
    tips = len(unit.heights)
    delays = np.zeros(tips)
    if signal is not None and signal.delay_ms and rate * (1.0 / signal.rate_Hz) < 1.0 / AT_ONCE:
        delays = 1e-3 * np.array(signal.delay_ms)
    tare_s = max(TARE_S, TARE_SAMPLES / rate)
    begins, end = [], tare_s
    for press in presses:
        begins.append(end)
        end += press.lasts_s + PAUSE_S
    t = np.arange(int(np.ceil(end * rate)) + 1) / rate
    at = t[:, None] + delays
    if rng is not None:
        late = rng.uniform(-1.0, 1.0, tips)
        if signal is not None:
            at = at + np.sqrt(3.0) * (signal.time_deviation / signal.rate_Hz) * late
    deflections = np.zeros((len(t), tips))
    for begin, press in zip(begins, presses, strict=True):
        deflections += press.at(at - begin)
    shown = unit.shown(deflections)
    if rng is not None:
        shown = shown + unit.noise * rng.normal(size=shown.shape)
    shown[t >= tare_s] += unit.zero_drift
    return _lines(unit, t, shown)


def _lines(unit: SimulatedUnit, t: Floats, shown: Floats) -> list[str]:
    """Return a header and one line for each sample."""
    tips = shown.shape[1]
    if unit.saturation is None:
        names = [f"{key}_N" for key in force_keys(tips)]
        cells = [[f"{value:.7g}" for value in row] for row in shown.tolist()]
    else:
        names = list(count_keys(tips))
        limit = unit.saturation
        cells = [[str(value) for value in row] for row in np.rint(shown).clip(-limit, limit).astype(int).tolist()]
    rows = [f"{at:.5f},{','.join(row)}" for at, row in zip(t.tolist(), cells, strict=True)]
    return [",".join(["t_s", *names]), *rows]
