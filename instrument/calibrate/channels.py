"""Channels from weights: the counts of every channel while one tip after the other is loaded; gains and crosstalk."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from instrument.calibrate.line_checks import Bend, LackOfFit
from instrument.calibrate.weighing import line_through, refuse_odd_row
from instrument.press.signals import count_keys
from pipeline.report.report import Report
from pipeline.tables.files import place_of
from pipeline.tables.measured_table import MeasuredTable
from sensor.arrays import Floats
from sensor.quantity import BOUNDED, COVERAGE, Estimate, validation_error

USUAL_SATURATION = 2**23 - 1
"""The largest count of a converter of 24 bits."""
_WORST_CONDITION = 100.0  # of gains, each over its own channel's: beyond it channels do not tell the tips apart


@dataclass(frozen=True, kw_only=True)
class ChannelCalibration:
    """What weights tell of the channels, in the order of the tips.

    `counts_per_N` (channels, tips) are slopes, `gain_percent` what is left of the force of each tip, one sigma.
    `bend_percent` is the change of the slope of each channel from no weight to the largest, 0 where scatter explains
    it; `lacks_of_fit` are what it makes wrong. `crosstalk_percent` is the largest slope of a channel over a tip that is
    not its own, of its own one. `hysteresis_percent` is how far readings of one weight are apart at most.
    `drift_percent` is how far the last reading without weight is from the first. Both are of what the largest weight
    shows.
    """

    counts_per_N: Floats
    zero_counts: Floats
    saturation: int
    gain_percent: tuple[float, ...]
    lacks_of_fit: tuple[LackOfFit, ...]
    bend_percent: tuple[float, ...]
    crosstalk_percent: tuple[float, ...]
    hysteresis_percent: tuple[float, ...]
    drift_percent: tuple[float, ...]

    @property
    def newtons_per_count(self) -> tuple[tuple[float, ...], ...]:
        """Return the matrix from counts above tare to forces [N], (tips, channels)."""
        return tuple(map(tuple, np.linalg.inv(self.counts_per_N).tolist()))


def saturation_of(report: Report) -> int:
    """Return the largest count of the converter of a design, of 24 bits where it has no read-out."""
    signal = report.read_out.signal
    return USUAL_SATURATION if signal is None else signal.saturation_counts


def weighed_channels(table: MeasuredTable, report: Report) -> ChannelCalibration | None:
    """Return the channels of a table of weights, tare first; None where it has no counts.

    Raises InputError for a tip whose first row has a weight, and for channels that do not tell
    the tips apart.
    """
    names = [tip.name for tip in report.tips]
    keys = count_keys(len(names))
    if keys[0] not in table.numbers:
        return None
    counts = counts_of(table, keys)
    forces = table.numbers["force"]
    tips = np.array(table.texts["tip"])
    slopes = np.empty((len(names), len(names)))
    returns = []
    bends: list[Bend] = []
    for tip, name in enumerate(names):
        rows = np.flatnonzero(tips == name)
        loads = forces[rows]
        if loads[0] != 0.0:
            place = place_of(table.source, table.lines[int(rows[0])], "tip")
            raise validation_error(place, float(loads[0]), "N", "0 in the first row of a tip", "tare first")
        lines = []
        for key in keys:
            field = f"{table.source}: {key} over the weight on {name}"
            lines.append(line_through(field, loads, table.numbers[key][rows], table.last_digits[key][rows], "counts/N"))
        slopes[:, tip] = [line.slope.value for line in lines]
        own, bend = lines[tip]
        bends.append(bend)
        shown = counts[rows, tip]
        refuse_odd_row(table, rows, "force", keys[tip], "counts", float(np.ptp(shown)))
        if not COVERAGE * own.error < abs(own.value):
            field = f"{table.source}: {keys[tip]} over the weight on {name}"
            bound = f"known to 100 %, not ± {COVERAGE * own.error:.2g} counts/N"
            raise validation_error(field, own.value, "counts/N", bound, "check the channel and its wires")
        returns.append(_return_of(own, loads, shown))
    # a channel of another tip shows little: its rows are judged over the span of its own, which is known now
    for name in names:
        rows = np.flatnonzero(tips == name)
        for channel, key in enumerate(keys):
            own_loads = forces[tips == names[channel]]
            refuse_odd_row(table, rows, "force", key, "counts", float(slopes[channel, channel] * np.ptp(own_loads)))
    return ChannelCalibration(
        counts_per_N=slopes,
        zero_counts=counts[forces == 0.0].mean(axis=0),
        saturation=saturation_of(report),
        gain_percent=tuple(each.gain_percent for each in returns),
        lacks_of_fit=tuple(bend.lack_of_fit for bend in bends),
        bend_percent=tuple(100.0 * bend.told_change for bend in bends),
        crosstalk_percent=_crosstalk_percent(table, names, keys, slopes),
        hysteresis_percent=tuple(each.hysteresis_percent for each in returns),
        drift_percent=tuple(each.drift_percent for each in returns),
    )


class _Return(NamedTuple):
    """How well a channel comes back to its counts; each as `ChannelCalibration` has it, of one channel."""

    gain_percent: float
    hysteresis_percent: float
    drift_percent: float


def _return_of(own: Estimate, loads: Floats, shown: Floats) -> _Return:
    """Return how well a channel of a slope [counts/N] comes back, by its counts under loads [N] on its own tip."""
    span = abs(own.value) * float(np.ptp(loads))
    unlike = max(float(np.ptp(shown[loads == load])) for load in set(loads.tolist()))
    hysteresis = 100.0 * unlike / span
    without = shown[loads == 0.0]
    drift = 100.0 * float(without[-1] - without[0]) / span
    # What comes back otherwise lies anywhere within its width (JCGM 100:2008, 4.3.7).
    return _Return(float(np.hypot(own.percent, BOUNDED * 0.5 * hysteresis)), hysteresis, drift)


def _crosstalk_percent(
    table: MeasuredTable, names: Sequence[str], keys: Sequence[str], slopes: Floats
) -> tuple[float, ...]:
    """Return the largest slope of each channel over another tip, of its own one [%].

    Raises InputError where channels do not tell the tips apart.
    """
    relative = slopes / np.diag(slopes)[:, None]
    others = np.abs(relative - np.eye(len(names))).max(axis=1)
    if not others.max() < 1.0:
        channel = int(others.argmax())
        field = f"{table.source}: largest counts/N of {keys[channel]} by another tip, over that of {names[channel]}"
        bound = "below 1: each channel responds most to its own tip"
        raise validation_error(field, float(f"{others[channel]:.4g}"), "", bound, "check order and wires")
    if not np.linalg.cond(relative) < _WORST_CONDITION:
        bound = "a table in which each channel responds most to its own tip"
        raise validation_error(table.source, float(np.linalg.cond(relative)), "", bound, "check order and wires")
    return tuple((100.0 * others).tolist())


def counts_of(table: MeasuredTable, keys: Sequence[str]) -> Floats:
    """Return the counts of all channels, (rows, channels)."""
    return np.column_stack([table.numbers[key] for key in keys])
