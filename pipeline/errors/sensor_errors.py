"""All errors of a sensor: budgets of its numbers, the table with bands of the modulus, and the scatter of prints."""

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
from pipeline.errors.targets import ForceRatioCurve, SceneTargets, characteristic, force_errors_of_springs
from pipeline.options import RunOptions
from pipeline.reading.analysis import ModulusAccuracy, ReadingAccuracy
from pipeline.reading.pressed_sensor import PressedSensor
from pipeline.response.scene_press import ScenePress
from sensor.arrays import Floats
from sensor.record import Record
from solve.contact.linear_response import SensorResponse


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class ReadingTable(Record):
    """The response of the scene, and two bands of the modulus for each P [MPa].

    `printed` and `calibrated` have shape (moduli, travels, 2), lower and upper. They are nan if a tip is out of
    contact, or the springs show no such P. The band as printed contains the errors of mesh, model and inputs. After
    calibration each stiffness is known to 1 %, and effects that calibration removes are left out. Row 0 is for the
    softest possible flesh, which only NL needs; it has no band.
    """

    response: SensorResponse
    printed: Floats
    calibrated: Floats


@dataclass(frozen=True, kw_only=True, repr=False)
class SensorErrors(Record):
    """The budgets, the table for the user, and the scatter of prints if fabrication was requested."""

    budgets: Budgets
    reading: ReadingTable
    scatter: ScatterBands | None


def sensor_errors(
    sensor: PressedSensor,
    reached: SceneTargets,
    press: ScenePress,
    options: RunOptions,
    readings: ReadingAccuracy | None,
) -> SensorErrors:
    """Return all errors of a sensor with its P_max and NL in its scene.

    The table of a sensor with readings shows their uncertainty.
    """
    pair = sensor.pair
    if readings is not None:
        budgets = uncertainty_budgets(pair, reached, press, None)
        return SensorErrors(budgets=budgets, reading=table_of_readings(press.curve, readings, budgets), scatter=None)
    level = level_press(pair, press.curve.E, press.curve.x)
    return SensorErrors(
        budgets=uncertainty_budgets(pair, reached, press, level),
        reading=reading_table(pair, press.curve, level),
        scatter=scatter_bands(pair, level) if options.fabrication else None,
    )


def reading_table(pair: PressedSensor, curve: SensorResponse, level: LevelPress) -> ReadingTable:
    """Return the table of the curve of a scene with its two bands of the modulus.

    The numerical error of P comes from the scene; the other errors come from a level sensor in the same press.
    """
    of_springs = [force_errors_of_springs(pair, E).sum() for E in curve.E.tolist()]
    numerical = curve.P_error + np.array(of_springs)[:, None]
    change = relative_change(level.ratio)
    law = characteristic(pair)
    return ReadingTable(
        response=curve,
        printed=_bands_of_ratio(law, curve, total_errors(numerical, level.causes, change)),
        calibrated=_bands_of_ratio(law, curve, total_errors(numerical, after_calibration(level.causes), change)),
    )


def _bands_of_ratio(law: ForceRatioCurve, curve: SensorResponse, errors: Floats) -> Floats:
    """Return the moduli [MPa] that may show each P with its error [1], shape (moduli, travels, 2).

    The first modulus has no band, nor has an unknown P.
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
    """Return the table of a sensor that reads a modulus at full travel, with two standard deviations and the bias.

    As printed, its springs are as uncertain as the print; after calibration, as the design's reading states.
    """
    rows = readings.moduli
    return ReadingTable(
        response=curve,
        printed=_bands(curve, rows, budgets.widest_spring),
        calibrated=_bands(curve, rows, 0.0),
    )


def _bands(curve: SensorResponse, rows: Sequence[ModulusAccuracy], spring_error: float) -> Floats:
    """Return the bands of readings at full travel; `spring_error` [1] is the error of the springs beyond calibration.

    Half the width is the bias plus two standard uncertainties, interpolated over ln E between the evaluated moduli.
    """
    bands = np.full((*curve.P.shape, 2), np.nan)
    if not rows:
        return bands
    widths = []
    for row in rows:
        two_sigma = math.hypot(2.0 * row.sources.total, spring_error * row.sources.stiffness_slope)
        widths.append(abs(row.bias.value) + two_sigma)
    E_read = [row.E for row in rows]
    E = curve.E[1:]  # without the first modulus, which is a limit
    width = np.interp(np.log(E), np.log(E_read), widths)
    bands[1:, -1, 0] = E * (1.0 - width)
    bands[1:, -1, 1] = E * (1.0 + width)
    return bands
