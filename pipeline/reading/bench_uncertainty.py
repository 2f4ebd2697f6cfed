"""Errors that remain in the springs and gains of a unit after its calibration on a bench with `pipeline calibrate`.

**Weights.** The compliance of a spring is the slope of its deflection against the weights hung on it. Weights and
deflections are rounded to the resolution of the balance and of the dial, so these two errors add in quadrature. A gain
is the slope of the counts against the same weights, with errors due to the balance and to noise.

**A plate.** All tips press a hard plate, and each channel is calibrated against their common travel. The error due to
the dial is then the same for all tips and cancels between them. The stiffness of a spring is the force, calibrated by
weights, divided by that travel.

Scale errors of the balance or the dial do not change the residuals of a straight line. The calibration cannot detect
scale errors, so they are neglected.
"""

import math
from typing import NamedTuple

import numpy as np

from pipeline.reading.reading_records import CalibrationErrors
from sensor.arrays import Floats
from sensor.design.bench import PLATE_AT, PRESSED, WEIGHED_AT, Bench, modulus_on_glass
from sensor.design.parameters import Design
from sensor.design.reading import ReadingRequirements
from sensor.quantity import STANDARD_GRAVITY, UNIFORM_DEVIATION, validation_error
from sensor.theory.hertz import force_factor
from sensor.theory.straight_line import ROUNDED, slope_error_of_resolution

LEAST_ERROR = 1e-4
"""Lower bound of the relative error of a stiffness; no dial and no balance is more accurate."""
_LARGEST_ERROR = 10.0  # relative error assigned to a spring that the bench cannot measure; large, but finite
# E is at most proportional to this power of a common factor of all deflections, which is the exponent of Hertz's law.
_STEEPEST = 1.5


def refuse_bench_that_cannot_weigh(design: Design) -> None:
    """Raise InputError if the balance of the bench cannot calibrate a low spring of the design.

    The weight that bends such a spring by the travel of a press must exceed the resolution of the balance. A fraction
    `PRESSED` of this weight must not exceed the largest load. Nothing is solved here, so only springs given in the
    design are checked.
    """
    bench = design.bench
    K_l = design.springs.K_l_N_per_m
    if bench is None or K_l is None:
        return
    # A low tip deflects by at most the full travel, and by nearly as much on firm fruit.
    grams = K_l * design.full_travels_mm[0] / STANDARD_GRAVITY  # [N/m * mm] is [mN], and 1 mN / (1 m/s^2) is 1 g
    weight_text = f"the weight that bends a low spring of {K_l:g} N/m by the travel of a press"
    if not bench.balance_g < grams:
        bound = f"less than {grams:.3g} g, {weight_text}"
        raise validation_error(
            "bench.balance_g", bench.balance_g, "g", bound, "use a balance with a finer resolution, or stiffer springs"
        )
    if not bench.balance_max_g >= PRESSED * grams:
        bound = f"at least {PRESSED * grams:.3g} g, {PRESSED:g} of {weight_text}"
        hint = "use a balance for larger loads, or softer springs"
        raise validation_error("bench.balance_max_g", bench.balance_max_g, "g", bound, hint)


def flattening(design: Design, forces: Floats) -> Floats:
    """Return the flattening [mm] of domes that `forces` (tips,) [N] press against glass; 0 for flat tips.

    A negative force is treated as 0. Source: contact of two elastic bodies, K. L. Johnson, Contact Mechanics (1985),
    (4.23), doi:10.1017/CBO9781139171731.
    """
    radius = design.tips.dome_radius_mm
    if radius is None:
        return np.zeros(len(forces))
    factor = force_factor(modulus_on_glass(design.process), radius)
    return np.asarray((np.maximum(forces, 0.0) / factor) ** (2.0 / 3.0))


def deflections_on_plate(scatter: Floats, flattened: Floats, design: Design, span: float) -> Floats:
    """Return the relative standard deviation [1] of the deflections that calibrate each channel on a plate.

    The result has the shape (tips,). `scatter` (tips,) [1] is the relative error of the slope of each channel's line.
    On the plate, the travel is the deflection of a tip's spring plus the flattening of the tip. Over a `span` [mm] of
    the travel, the flattening is `flattened` (tips,) [mm]. The flattening is proportional to E^(-2/3), where E is the
    modulus of the print, which differs from print to print. So the relative error of the flattening is 2/3 of the
    relative error of E.
    """
    modulus_scatter = 2.0 / 3.0 * design.process.E_scatter * flattened / span if span > 0.0 else 0.0
    return np.maximum(np.hypot(scatter, modulus_scatter), LEAST_ERROR)


def springs_on_plate(
    *, gains: Floats, deflections: Floats, travel: float, mean_difference: float, differences_from_mean: Floats
) -> Floats:
    """Return the relative standard deviation [1] of each spring stiffness after calibration on a plate, shape (tips,).

    `gains` (tips,), `deflections` (tips,) and `travel` are the relative standard deviations [1] of the forces, the
    deflections and the travel. The stiffnesses measured by plate and by weights differ. `mean_difference` [1] is the
    mean of their relative differences. `differences_from_mean` (tips,) [1] holds the deviation of each spring from this
    mean. Both differences are bounds within which the true stiffness is uniformly distributed (JCGM 100:2008, 4.3.7).
    """
    # The errors of the springs are later combined as if they were independent. The error of the travel and the mean
    # difference are common to all springs, so they change E more than independent errors of n springs would. The factor
    # sqrt(n) and the steepest dependence of E on a common factor account for this.
    common_error = _STEEPEST * np.sqrt(len(gains)) * np.hypot(travel, UNIFORM_DEVIATION * mean_difference)
    contributions = [gains, deflections, np.full(len(gains), common_error), UNIFORM_DEVIATION * differences_from_mean]
    return np.asarray(np.linalg.norm(contributions, axis=0))


class _ChannelErrors(NamedTuple):
    """Relative standard deviations [1] of springs and gains, and of the springs due to each cause, all (tips,)."""

    springs: Floats
    gains: Floats
    causes: dict[str, Floats]


def calibration_errors(design: Design, full_scale: Floats, stiffnesses: Floats, noises: Floats) -> CalibrationErrors:
    """Compute the relative errors of springs and gains that remain after calibration on the bench of a design.

    If the design gives one of the percentages, it replaces the computed error. A design without a bench is assumed to
    use the default one. `full_scale` [N] are the largest forces, and `stiffnesses` [N/mm] the stiffnesses of the
    springs. `noises` [N] are the standard deviations of the forces in one row of the calibration table. All three have
    the shape (tips,).
    """
    reading = design.reading or ReadingRequirements()
    bench = design.expected_bench or Bench()
    largest_forces = PRESSED * np.nan_to_num(full_scale)  # nan if every contact is too wide
    errors = _errors_after_weights(bench, largest_forces, stiffnesses, noises)
    if reading.on_plate:
        errors = _errors_after_plate(design, bench, errors, largest_forces, stiffnesses, noises)
    worst = int(errors.springs.argmax())  # the tip whose spring has the largest error
    main_cause = max(errors.causes, key=lambda cause: float(errors.causes[cause][worst]))
    return CalibrationErrors(
        balance_g=bench.balance_g,
        balance_max_g=bench.balance_max_g,
        dial_mm=bench.dial_mm,
        typed=tuple(key for key in ("stiffness_percent", "gain_percent") if getattr(reading, key) is not None),
        worst_tip=design.tips.names[worst],
        by=main_cause,
        stiffness_percent=_given_or_computed(reading.stiffness_percent, errors.springs),
        gain_percent=_given_or_computed(reading.gain_percent, errors.gains),
    )


def _given_or_computed(given_percent: float | None, computed: Floats) -> tuple[float, ...]:
    """Return the error of each tip [%]: the percentage that the design gives, or else the `computed` errors [1]."""
    if given_percent is None:
        return tuple((100.0 * computed).tolist())
    return len(computed) * (given_percent,)


def _errors_after_weights(bench: Bench, largest_forces: Floats, stiffnesses: Floats, noises: Floats) -> _ChannelErrors:
    """Return the errors that remain after a calibration by weights.

    Each spring is loaded up to its force in `largest_forces` (tips,) [N], or up to the largest load of the `bench`'s
    balance. `stiffnesses` (tips,) are in N/mm. `noises` (tips,) [N] are standard deviations of one row of the table.
    """
    # The error is computed for a resolution of 1 and a largest value of 1, with rows at the fractions `WEIGHED_AT` of
    # this value. The relative error of any slope is then `slope_error_factor` * resolution / largest value.
    slope_error_factor = slope_error_of_resolution(1.0, 1.0, WEIGHED_AT)
    newtons_per_g = 1e-3 * STANDARD_GRAVITY
    loads = np.minimum(largest_forces, newtons_per_g * bench.balance_max_g)
    balance_error = _relative_error(slope_error_factor * newtons_per_g * bench.balance_g, loads)
    dial_error = _relative_error(slope_error_factor * bench.dial_mm, loads / stiffnesses)
    # `slope_error_factor` contains ROUNDED, the standard deviation of rounding, which does not apply to noise.
    noise_error = _relative_error(slope_error_factor / ROUNDED * noises, loads)
    springs = np.maximum(np.hypot(balance_error, dial_error), LEAST_ERROR)
    return _ChannelErrors(
        springs=springs,
        gains=np.hypot(balance_error, noise_error),
        causes={"balance": balance_error, "dial": dial_error},
    )


def _errors_after_plate(
    design: Design,
    bench: Bench,
    after_weights: _ChannelErrors,
    largest_forces: Floats,
    stiffnesses: Floats,
    noises: Floats,
) -> _ChannelErrors:
    """Return the errors that remain after a calibration by weights and then on a plate, which calibrates deflections.

    `after_weights` are the errors after the calibration by weights. All tips have the same travel on the plate. The
    press ends when the first tip reaches its force in `largest_forces` (tips,) [N]. `stiffnesses` (tips,) are in N/mm,
    and `noises` (tips,) [N] are standard deviations of one row of the table.
    """
    slope_error_factor = slope_error_of_resolution(1.0, 1.0, PLATE_AT)  # for a resolution and a largest value of 1
    full_travel = float((largest_forces / stiffnesses).min())  # travel at the end of the press on the plate [mm]
    plate_forces = full_travel * stiffnesses
    noise_error = _noise_part(after_weights)
    scatter = _relative_error(slope_error_factor / ROUNDED * noises, plate_forces)
    # change in the flattening of the domes from the first to the last row of the table [mm]
    flattened = flattening(design, plate_forces) - flattening(design, PLATE_AT[0] * plate_forces)
    deflections = deflections_on_plate(scatter, flattened, design, full_travel * (PLATE_AT[-1] - PLATE_AT[0]))
    travel_error = float(_relative_error(slope_error_factor * bench.dial_mm, full_travel))
    # The stiffnesses by plate and by weights contain the same error of the balance, so it cancels in their ratio.
    ratio_errors = np.hypot(after_weights.causes["dial"], noise_error)
    mean_error, errors_from_mean = _errors_of_mean(ratio_errors)
    springs = springs_on_plate(
        gains=after_weights.gains,
        deflections=deflections,
        travel=travel_error,
        mean_difference=math.hypot(travel_error, mean_error),  # all tips share the error of the travel
        differences_from_mean=errors_from_mean,
    )
    # The rest of the variance is attributed to the dial, on which the travel is read.
    dial_error = np.sqrt(np.maximum(springs**2 - after_weights.gains**2 - deflections**2, 0.0))
    causes = {
        "balance": after_weights.causes["balance"],
        "dial": dial_error,
        "noise": np.hypot(noise_error, deflections),
    }
    # The channels measure deflections, so the errors of their gains are the errors of the deflections.
    return _ChannelErrors(springs=springs, gains=deflections, causes=causes)


def _noise_part(after_weights: _ChannelErrors) -> Floats:
    """Return the part of the errors of the gains that is due to noise [1], shape (tips,).

    After a calibration by weights, the error of a gain is due to the balance and to noise, whose squares add. Round-off
    may make the difference of squares slightly negative, so it is limited to 0.
    """
    return np.sqrt(np.maximum(after_weights.gains**2 - after_weights.causes["balance"] ** 2, 0.0))


def _errors_of_mean(deviations: Floats) -> tuple[float, Floats]:
    """Return the standard deviation of the mean of independent values, and of the difference of each from the mean.

    `deviations` (n,) are the standard deviations s_i of the values. The variance of the mean is sum(s_i^2) / n^2. The
    variance of the difference of a value from the mean is s_i^2 (1 - 2 / n) plus the variance of the mean.
    """
    mean_error = float(np.linalg.norm(deviations)) / len(deviations)
    return mean_error, np.sqrt(np.maximum(deviations**2 * (1.0 - 2.0 / len(deviations)) + mean_error**2, 0.0))


def _relative_error(deviation: Floats | float, largest: Floats | float) -> Floats:
    """Return `deviation` divided by the `largest` value measured [1], but at most `_LARGEST_ERROR`.

    Both arguments have the same unit. If the largest value is 0, nothing was measured, and the result is
    `_LARGEST_ERROR`.
    """
    largest_values = np.asarray(largest, dtype=float)
    relative = np.divide(
        deviation, largest_values, out=np.full(largest_values.shape, _LARGEST_ERROR), where=largest_values > 0.0
    )
    return np.asarray(np.minimum(relative, _LARGEST_ERROR))
