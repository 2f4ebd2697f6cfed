"""Errors that a calibration bench leaves in the springs and gains of a unit, by the lines of `pipeline calibrate`.

**Weights.** A spring is the slope of a deflection over a weight. Both are rounded to their last digits, so the errors
of balance and dial add in quadrature. A gain is the slope of counts over the same weights, with the errors of balance
and noise.

**A plate.** A deflection is calibrated against the common travel of all tips, so the digits of the dial cancel in it. A
spring is then the force that weights calibrated over that travel.

Scale errors of balance or dial show in no line, and are left out.
"""

import math
from typing import NamedTuple

import numpy as np

from pipeline.reading.reading_records import CalibrationLeft
from sensor.arrays import Floats
from sensor.design.bench import PLATE_AT, PRESSED, WEIGHED_AT, Bench, modulus_on_glass
from sensor.design.parameters import Design
from sensor.design.reading import ReadingRequirements
from sensor.quantity import BOUNDED, STANDARD_GRAVITY, validation_error
from sensor.theory.hertz import force_factor
from sensor.theory.straight_line import ROUNDED, left_by_digits

LEAST_ERROR = 1e-4
"""Least relative error of a stiffness; no dial and no weight is better."""
_LARGEST_ERROR = 10.0  # relative error of a spring that the bench cannot measure
_STEEPEST = 1.5  # largest exponent of E over a common factor of all deflections, for Hertz contacts


def refuse_bench_that_cannot_weigh(design: Design) -> None:
    """Raise InputError for a bench whose balance cannot weigh a low spring of the design, before anything is solved."""
    bench, softest = design.bench, design.springs.K_l_N_per_m
    if bench is None or softest is None:
        return
    # A low tip deflects by nearly all of the travel, and at most by all of it.
    grams = softest * design.full_travels_mm[0] / STANDARD_GRAVITY
    whose = f"the weight that bends a low spring of {softest:g} N/m by the travel of a press"
    if not bench.balance_g < grams:
        bound = f"less than {grams:.3g} g, {whose}"
        raise validation_error(
            "bench.balance_g", bench.balance_g, "g", bound, "take a finer balance or stiffer springs"
        )
    if not bench.balance_max_g >= PRESSED * grams:
        bound = f"at least {PRESSED * grams:.3g} g, {PRESSED:g} of {whose}"
        hint = "take a balance for larger loads, or softer springs"
        raise validation_error("bench.balance_max_g", bench.balance_max_g, "g", bound, hint)


def flattening(design: Design, forces: Floats) -> Floats:
    """Return the flattening of a tip on glass [mm] by forces [N]; 0 for a flat face.

    Two elastic bodies: K. L. Johnson, Contact Mechanics (1985), (4.23), doi:10.1017/CBO9781139171731.
    """
    radius = design.tips.dome_radius_mm
    if radius is None:
        return np.zeros(len(forces))
    factor = force_factor(modulus_on_glass(design.process), radius)
    return np.asarray((np.maximum(forces, 0.0) / factor) ** (2.0 / 3.0))


def deflections_on_plate(scatter: Floats, flattened: Floats, design: Design, span: float) -> Floats:
    """Return the relative standard deviation of the deflection that each channel shows [1], (tips,).

    `scatter` [1] is the error of each channel's line over the travel. Over a `span` of the travel [mm] each tip
    flattens by `flattened` [mm]. The flattening is proportional to the power -2/3 of the modulus of the print, which
    scatters.
    """
    by_modulus = 2.0 / 3.0 * design.process.E_scatter * flattened / span if span > 0.0 else 0.0
    return np.maximum(np.hypot(scatter, by_modulus), LEAST_ERROR)


def springs_on_plate(*, gains: Floats, deflections: Floats, travel: float, alike: float, apart: Floats) -> Floats:
    """Return the relative standard deviation of each spring that a plate determines [1], (tips,).

    `gains` are the deviations of the forces, `deflections` of the deflections that channels show, and `travel` of the
    travel. Compared with weights, the stiffnesses differ by `alike` in their mean and by `apart` from this mean. A
    spring lies anywhere within both (JCGM 100:2008, 4.3.7).
    """
    # The errors of springs are later added as independent; travel and balance change all of them, so theirs are
    # enlarged.
    of_all = _STEEPEST * np.sqrt(len(gains)) * np.hypot(travel, BOUNDED * alike)
    causes = [gains, deflections, np.full(len(gains), of_all), BOUNDED * apart]
    return np.asarray(np.linalg.norm(causes, axis=0))


class _Left(NamedTuple):
    """Relative standard deviations of springs and gains [1], and of the springs by each cause, all (tips,)."""

    springs: Floats
    gains: Floats
    causes: dict[str, Floats]


def left_by_bench(design: Design, full_scale: Floats, stiffnesses: Floats, noises: Floats) -> CalibrationLeft:
    """Return the errors that the bench of a design leaves in springs and gains.

    A percentage in the design replaces them.

    `full_scale` are the largest forces [N], `noises` the noise of one row of counts [N], and `stiffnesses` the springs
    [N/mm], all (tips,).
    """
    reading, bench = design.reading or ReadingRequirements(), design.expected_bench or Bench()
    pressed = PRESSED * np.nan_to_num(full_scale)
    left = _by_weights(bench, pressed, stiffnesses, noises)
    if reading.on_plate:
        left = _by_plate(design, bench, left, pressed, stiffnesses, noises)
    worst = int(left.springs.argmax())
    solved = {"stiffness_percent": left.springs, "gain_percent": left.gains}
    given = {key: percent for key in solved if (percent := getattr(reading, key)) is not None}
    tips = len(pressed)
    return CalibrationLeft(
        balance_g=bench.balance_g,
        balance_max_g=bench.balance_max_g,
        dial_mm=bench.dial_mm,
        typed=tuple(given),
        worst_tip=design.tips.names[worst],
        by=max(left.causes, key=lambda cause: float(left.causes[cause][worst])),
        **{key: tips * (given[key],) if key in given else tuple((100.0 * solved[key]).tolist()) for key in solved},
    )


def _by_weights(bench: Bench, pressed: Floats, stiffnesses: Floats, noises: Floats) -> _Left:
    """Return the errors after weights, up to forces `pressed` [N] or the largest load of the balance."""
    per_digit = left_by_digits(1.0, 1.0, WEIGHED_AT)
    newtons_per_g = 1e-3 * STANDARD_GRAVITY
    loads = np.minimum(pressed, newtons_per_g * bench.balance_max_g)
    by_balance = _over(per_digit * newtons_per_g * bench.balance_g, loads)
    by_dial = _over(per_digit * bench.dial_mm, loads / stiffnesses)
    by_noise = _over(per_digit / ROUNDED * noises, loads)
    springs = np.maximum(np.hypot(by_balance, by_dial), LEAST_ERROR)
    return _Left(springs, np.hypot(by_balance, by_noise), {"balance": by_balance, "dial": by_dial})


def _by_plate(
    design: Design, bench: Bench, weighed: _Left, pressed: Floats, stiffnesses: Floats, noises: Floats
) -> _Left:
    """Return the errors after weights and a plate; the tip with the least deflection limits the travel."""
    per_digit = left_by_digits(1.0, 1.0, PLATE_AT)
    deepest = float((pressed / stiffnesses).min())
    largest = deepest * stiffnesses
    flattened = flattening(design, largest) - flattening(design, PLATE_AT[0] * largest)
    scatter = _over(per_digit / ROUNDED * noises, largest)
    by_noise = np.sqrt(np.maximum(weighed.gains**2 - weighed.causes["balance"] ** 2, 0.0))
    deflections = deflections_on_plate(scatter, flattened, design, deepest * (PLATE_AT[-1] - PLATE_AT[0]))
    travel = float(_over(per_digit * bench.dial_mm, deepest))
    # The error of the balance is in both forces, and cancels in the ratio of plate to weights.
    ratios = np.hypot(weighed.causes["dial"], by_noise)
    of_mean = float(np.linalg.norm(ratios)) / len(ratios)
    from_mean = np.sqrt(np.maximum(ratios**2 * (1.0 - 2.0 / len(ratios)) + of_mean**2, 0.0))
    springs = springs_on_plate(
        gains=weighed.gains,
        deflections=deflections,
        travel=travel,
        alike=math.hypot(travel, of_mean),
        apart=from_mean,
    )
    by_dial = np.sqrt(np.maximum(springs**2 - weighed.gains**2 - deflections**2, 0.0))
    causes = {"balance": weighed.causes["balance"], "dial": by_dial, "noise": np.hypot(by_noise, deflections)}
    return _Left(springs, deflections, causes)


def _over(deviation: Floats | float, largest: Floats | float) -> Floats:
    """Return deviations over largest values [1], at most ten if the bench cannot measure them."""
    shown = np.asarray(largest, dtype=float)
    relative = np.divide(deviation, shown, out=np.full(shown.shape, _LARGEST_ERROR), where=shown > 0.0)
    return np.asarray(np.minimum(relative, _LARGEST_ERROR))
