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

    `printed` and `calibrated` have shape (moduli, travels, 2), with the lower and the upper end. They are nan if a tip
    is out of contact, or if the springs cannot produce this P. The band as printed contains the errors of the mesh, the
    model and the inputs. After calibration, each stiffness is known to 1 %, and effects that calibration removes are
    left out. Row 0 is for a modulus of nearly zero. It is needed only for NL, and has no band.
    """

    response: SensorResponse
    printed: Floats
    calibrated: Floats


@dataclass(frozen=True, kw_only=True, repr=False)
class SensorErrors(Record):
    """The error budgets, the response table, and the scatter of prints if fabrication was requested."""

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
    computed only if `options` request files for fabrication. For a sensor with `readings`, the bands of the table show
    the uncertainty of these readings. Its force ratio has no budget, and its scatter is not computed.
    """
    pair = sensor.pair  # two springs represent all springs of the sensor
    if readings is not None:
        budgets = uncertainty_budgets(pair, targets, press, None)
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
    # The relative errors of the two forces add in their ratio.
    spring_errors = [force_errors_of_springs(pair, E).sum() for E in curve.E.tolist()]
    numerical = curve.P_error + np.array(spring_errors)[:, None]
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
    nan for an unknown P, and for the first modulus, which is nearly zero. It is also nan at a travel at which P does
    not increase with the modulus.
    """
    bands = np.full((*curve.P.shape, 2), np.nan)
    for j in range(len(curve.x)):
        modulus_at = law.modulus_scale(curve.P[:, j], curve.E)
        if modulus_at is None:
            continue
        for i, P in enumerate(curve.P[1:, j].tolist(), start=1):
            if math.isfinite(P):
                bands[i, j] = [modulus_at(P * (1.0 + sign * float(errors[i, j]))) for sign in (-1.0, 1.0)]
    return bands


def table_of_readings(curve: SensorResponse, readings: ReadingAccuracy, budgets: Budgets) -> ReadingTable:
    """Return the response table of a sensor with readings. Its bands are for the modulus read at full travel.

    `curve` is the response of the scene. As printed, the springs also have the scatter of prints, from `budgets`. After
    calibration, they have the uncertainty in `[reading]`.
    """
    accuracies = readings.moduli
    return ReadingTable(
        response=curve,
        printed=_bands_of_readings(curve, accuracies, budgets.widest_spring),
        calibrated=_bands_of_readings(curve, accuracies, 0.0),
    )


def _bands_of_readings(curve: SensorResponse, accuracies: Sequence[ModulusAccuracy], spring_error: float) -> Floats:
    """Return the smallest and the largest modulus [MPa] for readings at full travel, shape (moduli, travels, 2).

    The half width of a band, relative to E, is the bias plus two standard uncertainties. It is interpolated in ln E
    between the moduli of `accuracies`. `spring_error` [1] is two standard deviations of an error of the stiffnesses, in
    addition to their calibration error. The bands are nan at other travels, and everywhere without accuracies.
    """
    bands = np.full((*curve.P.shape, 2), np.nan)
    if not accuracies:
        return bands
    half_widths = []  # relative to E [1]
    for accuracy in accuracies:
        two_sigma = math.hypot(2.0 * accuracy.sources.total, spring_error * accuracy.sources.stiffness_slope)
        half_widths.append(abs(accuracy.bias.value) + two_sigma)
    E_evaluated = [accuracy.E for accuracy in accuracies]
    E = curve.E[1:]  # the first modulus is nearly zero, and has no band
    half_width = np.interp(np.log(E), np.log(E_evaluated), half_widths)
    bands[1:, -1, 0] = E * (1.0 - half_width)
    bands[1:, -1, 1] = E * (1.0 + half_width)
    return bands
