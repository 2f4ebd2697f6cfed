"""All errors of a sensor: the budget of each number, the table with its bands of modulus, the scatter of prints."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.options import RunOptions
from pipeline.reading.analysis import ModulusReading, Readings
from pipeline.response.scene_press import ScenePress, spring_shares
from pipeline.verdicts.errors.budget import Budgets, effects_at, ratio_budget, uncertainty_budgets
from pipeline.verdicts.errors.effects import LevelSensor, effects_after_calibration
from pipeline.verdicts.errors.print_scatter import ScatterBands, print_scatter
from pipeline.verdicts.targets import Characteristic, SceneTargets
from solve.contact.linear_response import SensorResponse

Floats = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True, eq=False)
class ReadingTable:
    """The response of the scene, and two bands of the modulus that may show each P [MPa].

    `printed` and `calibrated` have shape (moduli, travels, 2), lower and upper; nan where a tip is off or the springs
    show no such P. The band as printed holds the errors of mesh, model and inputs; after calibrating the unit each
    stiffness is known to 1 %, and what calibration takes away is left out. The response has no row for a fruit that
    is softer than all.
    """

    response: SensorResponse
    printed: Floats
    calibrated: Floats


@dataclass(frozen=True, kw_only=True)
class SensorErrors:
    """The budgets, the table that a user reads, and how far prints scatter where fabrication was asked for."""

    budgets: Budgets
    reading: ReadingTable
    scatter: ScatterBands | None


def sensor_errors(
    sensor: LevelSensor, reached: SceneTargets, press: ScenePress, options: RunOptions, readings: Readings | None = None
) -> SensorErrors:
    """Return all errors of a sensor that reaches P_max and NL in its scene; raises as the solves of the scatter do.

    The table of a sensor with readings shows their uncertainty.
    """
    budgets = uncertainty_budgets(sensor, reached, press)
    if readings is not None:
        return SensorErrors(budgets=budgets, reading=table_of_readings(press.curve, readings, budgets), scatter=None)
    scatter = None
    if options.fabrication:
        scatter = print_scatter(sensor.design, sensor.contact, sensor.sizing, sensor.springs)
    return SensorErrors(budgets=budgets, reading=reading_table(sensor, press), scatter=scatter)


def reading_table(sensor: LevelSensor, press: ScenePress) -> ReadingTable:
    """Return the table of the scene; errors of P beyond its mesh's are those of a level sensor at the same press."""
    curve = press.curve
    law = sensor.characteristic
    spring_errors = np.divide(law.spring_errors, law.springs.stiffnesses)
    printed = np.full((*curve.P.shape, 2), np.nan)
    calibrated = np.full((*curve.P.shape, 2), np.nan)
    for j, travel in enumerate(curve.x.tolist()):
        scale = _RatioScale(law, curve.P[:, j], curve.E)
        if not scale.rises:
            continue
        for i, E in enumerate(curve.E.tolist()):
            P = float(curve.P[i, j])
            if i == 0 or not math.isfinite(P):  # the first modulus is no fruit's
                continue
            of_springs = float(spring_shares(sensor.contact, sensor.springs.C, E) @ spring_errors)
            numerical = float(curve.P_error[i, j]) + of_springs
            effects_printed = effects_at(sensor, E, travel)
            effects_calibrated = effects_after_calibration(effects_printed)
            error_printed = ratio_budget(sensor, E, travel, numerical, effects_printed).total
            error_calibrated = ratio_budget(sensor, E, travel, numerical, effects_calibrated).total
            printed[i, j] = scale.band(P, error_printed)
            calibrated[i, j] = scale.band(P, error_calibrated)
    return ReadingTable(response=curve, printed=printed, calibrated=calibrated)


class _RatioScale:
    """The modulus over P at one travel, through the two-spring law, under which it is nearly a straight line."""

    def __init__(self, law: Characteristic, P: Floats, E: Floats) -> None:
        """Take P [1] of the scene at the moduli [MPa], the softest first."""
        self._law = law
        self._P_softest = float(P[0])
        self._E = E
        self._stiffnesses = np.array([self._stiffness(ratio) for ratio in P.tolist()])
        self.rises = bool((np.diff(self._stiffnesses) > 0.0).all())

    def _stiffness(self, P: float) -> float:
        """Return the fruit stiffness at which a level sensor has P, were P 1 on the softest fruit [N/mm].

        It is nan where a tip is off the fruit.
        """
        ratio = P / self._P_softest * self._law.stiffness_ratio
        return self._law.fruit_stiffness(ratio) if math.isfinite(ratio) else math.nan

    def band(self, P: float, error: float) -> list[float]:
        """Return the lowest and the highest modulus [MPa] that may show P with a relative error [1]."""
        return [self.modulus(P * (1.0 - error)), self.modulus(P * (1.0 + error))]

    def modulus(self, P: float) -> float:
        """Return the modulus at P [MPa], on the line through the last two beyond the table; nan where there is none."""
        stiffness = self._stiffness(P)
        along = self._stiffnesses
        if not math.isfinite(stiffness):
            return math.nan
        if stiffness <= along[0]:
            return 0.0
        if stiffness <= along[-1]:
            return float(np.interp(stiffness, along, self._E))
        slope = (self._E[-1] - self._E[-2]) / (along[-1] - along[-2])
        return float(self._E[-1] + slope * (stiffness - along[-1]))


def table_of_readings(curve: SensorResponse, readings: Readings, budgets: Budgets) -> ReadingTable:
    """Return the table of a sensor that reads a modulus at full travel, with two sigma and the bias of its readings.

    As printed its springs are known as well as the print is, after calibrating as the design's reading says.
    """
    rows = readings.moduli
    return ReadingTable(
        response=curve,
        printed=_bands(curve, rows, budgets.widest_spring),
        calibrated=_bands(curve, rows, 0.0),
    )


def _bands(curve: SensorResponse, rows: Sequence[ModulusReading], spring_error: float) -> Floats:
    """Return the bands of readings at full travel whose springs are off by an error [1] beyond calibration."""
    bands = np.full((*curve.P.shape, 2), np.nan)
    if not rows:
        return bands
    widths = []
    for row in rows:
        two_sigma = math.hypot(2.0 * row.sources.total, spring_error * row.sources.stiffness_slope)
        widths.append(abs(row.bias) + two_sigma)
    E_read = [row.E for row in rows]
    E = curve.E[1:]  # without the softest fruit, which is a limit
    width = np.interp(np.log(E), np.log(E_read), widths)
    bands[1:, -1, 0] = E * (1.0 - width)
    bands[1:, -1, 1] = E * (1.0 + width)
    return bands
