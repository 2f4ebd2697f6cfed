"""All errors of a sensor: error budgets, the response table with modulus bands, and the scatter of prints."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pipeline.errors.budget import (
    Budgets,
    LevelPress,
    level_press,
    relative_change,
    total_errors,
    uncertainty_budgets,
)
from pipeline.errors.causes import after_calibration
from pipeline.errors.error_records import ScatterBands
from pipeline.errors.scatter_bands import scatter_bands
from pipeline.errors.targets import ForceRatioCurve, SceneTargets, force_errors_of_springs, force_ratio_curve
from pipeline.options import RunOptions
from pipeline.reading.analysis import ModulusAccuracy, ReadingAccuracy
from pipeline.reading.pressed_sensor import PressedSensor
from pipeline.response.scene_press import ScenePress
from sensor.arrays import Floats
from sensor.record import Record
from solve.contact.linear_response import SensorResponse


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class ReadingTable(Record):
    """The response of the scene, and two bands of the modulus [MPa] for each P.

    `printed` and `calibrated` have shape (moduli, travels, 2), with the lower and the upper end. The ends are nan if a
    tip is out of contact, or if the springs cannot produce this P. The band as `printed` contains the errors of the
    mesh, the model and the inputs. The `calibrated` band assumes that each stiffness is known to 1 %, and leaves out
    effects that calibration removes. Row 0 is for a modulus of nearly zero. This row is needed only for NL, and has no
    band.
    """

    response: SensorResponse
    printed: Floats
    calibrated: Floats


@dataclass(frozen=True, kw_only=True, repr=False)
class SensorErrors(Record):
    """The error budgets, the response table, and the scatter of prints, which is None unless it was computed."""

    budgets: Budgets
    reading: ReadingTable
    scatter: ScatterBands | None


def sensor_errors(
    sensor: PressedSensor,
    targets: SceneTargets,
    press: ScenePress,
    options: RunOptions,
    readings: ReadingAccuracy | None,
) -> SensorErrors:
    """Return the error budgets of a sensor, its response table with modulus bands, and the scatter of its prints.

    `targets` holds P_max and NL in the scene of the design, and `press` the solutions of this scene. The scatter is
    computed only if `options` request files for fabrication.

    If the design has `readings`, the bands of the table show the uncertainty of these readings. Such a sensor does not
    read the force ratio, so the force ratio has no budget and the scatter is not computed.
    """
    pair = sensor.pair  # two springs represent all springs of the sensor
    if readings is not None:
        budgets = uncertainty_budgets(pair, targets, press, None)  # without level presses, P_max and NL have no budget
        return SensorErrors(budgets=budgets, reading=table_of_readings(press.curve, readings, budgets), scatter=None)
    level = level_press(pair, press.curve.E, press.curve.x)
    return SensorErrors(
        budgets=uncertainty_budgets(pair, targets, press, level),
        reading=reading_table(pair, press.curve, level),
        scatter=scatter_bands(pair, level) if options.fabrication else None,
    )


def reading_table(pair: PressedSensor, curve: SensorResponse, level: LevelPress) -> ReadingTable:
    """Return the response of a scene as a table with two modulus bands: as printed, and after calibration.

    `curve` is the response of the scene, whose P has a numerical error. The errors due to other causes come from the
    `level` presses of the same pair, at the same moduli and travels.
    """
    # P is a ratio of two forces, so their relative errors add.
    spring_errors = [force_errors_of_springs(pair, E).sum() for E in curve.E.tolist()]
    numerical = curve.P_error + np.array(spring_errors)[:, None]  # the same spring error at all travels
    change = relative_change(level.ratio)
    law = force_ratio_curve(pair)
    return ReadingTable(
        response=curve,
        printed=_bands_of_ratio(law, curve, total_errors(numerical, level.causes, change)),
        calibrated=_bands_of_ratio(law, curve, total_errors(numerical, after_calibration(level.causes), change)),
    )


def _bands_of_ratio(law: ForceRatioCurve, curve: SensorResponse, errors: Floats) -> Floats:
    """Return the smallest and the largest modulus [MPa] consistent with each P of a curve, shape (moduli, travels, 2).

    `law` is the two-spring law of the pair. `errors` (moduli, travels) [1] are the relative errors of P. The band is
    nan for an unknown P, and for the first modulus, which is nearly zero. A band is also nan at a travel at which P
    does not increase with the modulus.
    """
    bands = np.full((*curve.P.shape, 2), np.nan)
    for j in range(len(curve.x)):
        modulus_at = law.modulus_converter(curve.P[:, j], curve.E)
        if modulus_at is None:  # P does not increase with the modulus at this travel
            continue
        for i, P in enumerate(curve.P[1:, j].tolist(), start=1):  # without the modulus of nearly zero
            if math.isfinite(P):
                error = float(errors[i, j])
                bands[i, j] = [modulus_at(P * (1.0 + sign * error)) for sign in (-1.0, 1.0)]
    return bands


def table_of_readings(curve: SensorResponse, readings: ReadingAccuracy, budgets: Budgets) -> ReadingTable:
    """Return the response table of a sensor with readings, whose bands are for the modulus read at full travel.

    `curve` is the response of the scene. Both bands contain the bias and all uncertainties of `readings`, in which the
    springs have their errors after calibration. The bands as printed add the scatter of the springs from print to
    print, which `budgets` hold.
    """
    accuracies = readings.moduli
    return ReadingTable(
        response=curve,
        printed=_bands_of_readings(curve, accuracies, budgets.largest_spring_error),
        calibrated=_bands_of_readings(curve, accuracies, 0.0),
    )


def _bands_of_readings(curve: SensorResponse, accuracies: Sequence[ModulusAccuracy], spring_error: float) -> Floats:
    """Return the smallest and the largest modulus [MPa] for readings at full travel, shape (moduli, travels, 2).

    The half width of a band, relative to E, is the bias plus two standard uncertainties. The half width is interpolated
    in ln E between the moduli of `accuracies`. `spring_error` [1] is two standard deviations of an error of the
    stiffnesses, in addition to their calibration error. The lower end is at least 0. The bands are nan at all travels
    before full travel. All bands are nan if `accuracies` is empty.
    """
    bands = np.full((*curve.P.shape, 2), np.nan)
    if not accuracies:
        return bands
    half_widths = []  # half width of the band at each modulus, relative to E [1]
    for accuracy in accuracies:
        two_sigma = math.hypot(2.0 * accuracy.sources.total, spring_error * accuracy.sources.stiffness_slope)
        half_widths.append(abs(accuracy.bias.value) + two_sigma)
    E_evaluated = [accuracy.E for accuracy in accuracies]
    E = curve.E[1:]  # the first modulus is nearly zero, and has no band
    half_width = np.interp(np.log(E), np.log(E_evaluated), half_widths)
    bands[1:, -1, 0] = E * np.maximum(1.0 - half_width, 0.0)  # a modulus is not negative
    bands[1:, -1, 1] = E * (1.0 + half_width)
    return bands
