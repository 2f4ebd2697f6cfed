"""Read presses from a signal; a press lasts from the touch of the last tip until the first tip lifts off."""

import itertools
import warnings
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Literal

import numpy as np

from instrument.press.contrast_press import press_reading
from instrument.press.count_codes import signed_counts
from instrument.press.fruit_reading import ZERO_AFTER_S, FruitReading
from instrument.press.measuring import MeasuringUnit
from instrument.press.one_time import simultaneous_samples
from instrument.press.printed_unit import PrintedUnit
from instrument.press.signals import Sample, Signal
from instrument.press.touches import PressSamples, split_presses
from pipeline.report.report import Report, check_report
from pipeline.tables.rows import rows_of
from sensor.arrays import Floats
from sensor.input_file import path_of
from sensor.quantity import validation_error
from sensor.turns import in_turn

TARE_SAMPLES = 10
"""Number of samples at the start of a signal in counts whose mean is the tare; the sensor must touch nothing then."""
_MOVED_ZERO = 0.05
"""Change of a zero since the calibration, relative to full scale [1], above which a note is reported.

A judgement: the zeros of Hall sensors drift by about 0.2 % per kelvin, and a fruit at a touch causes more.
"""
_TARE_HINT = f"let the sensor hang free and still for the first {TARE_SAMPLES} samples"


@in_turn()
def read_press(
    report: Report,
    file: str | Path,
    unit: PrintedUnit | str | Path | None = None,
    counts_as: Literal["unsigned", "offset"] | None = None,
) -> list[FruitReading]:
    """Return one reading for each press in a table of forces or counts, by the rules of `pipeline read`.

    The command also joins presses of one fruit, even without flags if a column names the fruit. By flags it takes
    ripeness classes, the radii of the fruit, and names and units of columns.

    Parameters
    ----------
    report : Report
        The report of the design, from `read_report`.
    file : str or Path
        The table, a CSV file or a workbook.
    unit : PrintedUnit, str or Path, optional
        A calibrated unit or its unit.toml. Without one, the unit has the springs of its design.
    counts_as : "unsigned" or "offset", optional
        How the table writes counts, if it writes them without signs.

    Returns
    -------
    list of FruitReading
        The readings in the order of their presses. If a press does not determine a modulus, its reading has only flags.

    Raises
    ------
    InputError
        If the table has no signal of this sensor, or the unit is not of this design.

    Warns
    -----
    UserWarning
        If lines are left out, a clock restarts, or the zero differs from the zero of the calibration.

    Examples
    --------
    >>> report = twintip.read_report(Path("outputs/mine"))  # written by pipeline run
    >>> [reading] = twintip.read_press(report, "press.csv")
    >>> reading.E > 0.0  # [MPa]
    True
    """
    check_report(report)
    sensor = MeasuringUnit.from_report(report, unit)
    signal = Signal(rows_of(path_of(file, "file")), len(report.tips), say=partial(warnings.warn, stacklevel=2))
    return list(readings_of(sensor, signal, counts_as=counts_as))


def readings_of(
    sensor: MeasuringUnit, signal: Signal, *, every_sample: bool = False, counts_as: str | None = None
) -> Iterator[FruitReading]:
    """Yield one reading for each press of a signal when it ends. With `every_sample`, yield one at each of its samples.

    A touch is a press only if it has enough samples in firm contact. A signal without a press yields the reading of its
    last light touch, or a reading with the flag `lift_off` if there was none. `counts_as` is the notation of counts
    without signs, as in `signed_counts`. Raises InputError for an invalid line, and if the report of a line or a square
    has no level readings of whole presses.
    """
    sensor.refuse_without_rise_level()
    if signal.counted:
        tare, recorded_samples = tare_of(sensor, signal, counts_as)
    else:
        tare, recorded_samples = None, iter(signal)
    timing, simultaneous = simultaneous_samples(sensor, recorded_samples, signal.source)
    in_newtons = _convert_to_newtons(sensor, signal, simultaneous, tare)
    light_touch = FruitReading(flags=("lift_off",))  # replaced by the reading of each light touch
    has_press = False
    for press in split_presses(sensor, in_newtons, signal.source, timing.lag, every_sample=every_sample):
        # A reading has the time of its newest sample, or of the deepest sample if the press has ended.
        t = float(press.t[-1 if every_sample else press.deepest])
        reading = replace(press_reading(sensor, press, timing), t=t)
        if every_sample:
            has_press = True
            yield replace(reading, fruit=press.fruit)
        elif press.is_firm(sensor.least_forces, timing.lag):
            has_press = True
            zero, relative_zero = zero_error_after_lift(sensor, press)
            yield replace(reading, fruit=press.fruit, zero_left=zero, zero_left_of_touch=relative_zero)
        else:  # too few samples in firm contact
            light_touch = reading
    if not has_press:
        yield light_touch


def _convert_to_newtons(
    sensor: MeasuringUnit, signal: Signal, samples: Iterable[Sample], tare: Sequence[float] | None
) -> Iterator[Sample]:
    """Yield samples with the forces of the tips [N], from channel forces, or from counts if there is a `tare`.

    The `tare` (channels,) is in counts. `signal` provides the names of cells for messages. Raises InputError for a
    force that is clearly below zero or far above full scale.
    """
    for sample in samples:
        channels = sample.forces if tare is None else sensor.unit.forces_of_counts(sample.forces, tare)
        forces = sensor.forces_of_channels(channels)
        refuse_out_of_scale(sensor, forces, partial(signal.place, sample))
        # The channels have been interpolated to one time, so their own times are no longer needed.
        yield sample._replace(forces=tuple(forces.tolist()), times=())


def zero_error_after_lift(sensor: MeasuringUnit, press: PressSamples) -> tuple[float | None, float | None]:
    """Return the zero error due to creep of the springs, `ZERO_AFTER_S` seconds after the lift of a press.

    The error is returned as a force [N] and as a fraction of the smallest contact force [1], for the tip with the
    largest fraction. Both are None if the springs do not creep or the duration of the press is unknown.
    """
    creep = sensor.creep
    press_s = press.duration_s  # time from the first touch to the deepest sample
    if creep.exponent == 0.0 or press_s is None:
        return None, None
    contact_s = float(press.t[-1]) - press.touched_s  # time from the first touch to the lift
    remaining_fraction = creep.residual_deflection(ZERO_AFTER_S, press_s, contact_s)
    deepest_forces = press.forces[press.deepest]
    relative_errors = remaining_fraction * deepest_forces / sensor.least_forces
    tip = int(relative_errors.argmax())
    return remaining_fraction * float(deepest_forces[tip]), float(relative_errors[tip])


def tare_of(
    sensor: MeasuringUnit, signal: Signal, counts_as: str | None = None
) -> tuple[list[float], Iterator[Sample]]:
    """Return the tare (channels,) of a signal [counts], and the samples after the tare with signed counts.

    The tare is the mean of the counts in the first `TARE_SAMPLES` samples, which are read from the signal here.
    `counts_as` is the notation of counts in the file, as in `signed_counts`. A note is reported if the tare is far from
    the zero of the calibration. Raises InputError if the counts of the unit are not calibrated, if the signal ends
    during the tare, if the sensor was touched during it, and for counts at the end of the converter's range.
    """
    unit = sensor.unit
    if not unit.newtons_per_count:
        bound = "a record of forces, because the counts of this unit are not calibrated"
        hint = "calibrate the unit with a table that has counts, and give --unit"
        raise validation_error("FILE.csv", "counts", "", bound, hint)

    def convert_to_signed(sample: Sample) -> Sample:
        counts = signed_counts(sample.forces, counts_as, unit.saturation_counts, partial(signal.place, sample))
        return sample._replace(forces=counts)

    samples = map(convert_to_signed, signal)
    tare_samples = list(itertools.islice(samples, TARE_SAMPLES))
    if len(tare_samples) < TARE_SAMPLES:
        place = signal.place(tare_samples[-1], 0)
        raise validation_error(place, len(tare_samples), "samples", f"at least {TARE_SAMPLES}", _TARE_HINT)
    tare = np.mean([sample.forces for sample in tare_samples], axis=0).tolist()
    zero_errors = _zero_errors(sensor, tare)
    _refuse_touched_tare(sensor, signal, tare_samples, tare, zero_errors)
    if zero_errors.max() > _MOVED_ZERO:
        signal.say(
            f"the zero of tip {sensor.report.tips[int(zero_errors.argmax())].name} is "
            f"{100.0 * zero_errors.max():.2g} % of full scale from the zero of the calibration: check that the file of "
            f"the unit is the right one, and that the sensor hangs free and in the same attitude at the start"
        )
    return tare, samples


def _zero_errors(sensor: MeasuringUnit, tare: Sequence[float]) -> Floats:
    """Return the distance of each force at `tare` [counts] from the calibrated zero, relative to full scale [1]."""
    unit = sensor.unit
    return np.abs(unit.forces_of_counts(tare, unit.zero_counts)) / sensor.report.read_out.full_scale_N


def _refuse_touched_tare(
    sensor: MeasuringUnit, signal: Signal, tare_samples: Sequence[Sample], tare: Sequence[float], zero_errors: Floats
) -> None:
    """Raise InputError if the counts of a tare show that the sensor was touched.

    The sensor was touched if the `tare` (channels,) [counts] is more than a full scale from the zero of the
    calibration, as given by `zero_errors` (tips,) [1]. It was also touched if one of the `tare_samples` differs from
    the tare by more than the smallest force of a tip in contact.
    """
    unit = sensor.unit
    if zero_errors.max() > 1.0:
        bound = "within one full scale of the zero in the calibration"
        tip = int(zero_errors.argmax())
        raise validation_error(signal.place(tare_samples[0], tip), tare[tip], "counts", bound, _TARE_HINT)
    for sample in tare_samples:
        # The force of the sample above the tare, as a multiple of the smallest force of a tip in contact.
        deviations = np.abs(unit.forces_of_counts(sample.forces, tare)) / sensor.least_forces
        if deviations.max() > 1.0:
            tip = int(deviations.argmax())
            raise validation_error(signal.place(sample, tip), sample.forces[tip], "counts", "steady", _TARE_HINT)


def refuse_out_of_scale(sensor: MeasuringUnit, forces: Sequence[float] | Floats, place: Callable[[int], str]) -> None:
    """Raise InputError if one of the `forces` (tips,) [N] is clearly below zero or far above full scale.

    `place` maps the index of a tip to the name of its cell in the message.
    """
    plausible = sensor.are_plausible(forces)
    if not plausible.all():
        tip = int(plausible.argmin())  # index of the first False
        lowest = sensor.lowest_forces[tip]
        bound = f"from {lowest:.3g} N, the limit of noise, to {sensor.largest_forces[tip]:.3g} N, 20 full scales"
        hint = "check the zero, the sign and the unit of the channel"
        raise validation_error(place(tip), float(forces[tip]), "N", bound, hint)
