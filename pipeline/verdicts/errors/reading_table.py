"""The table that a user of the sensor reads: forces and P over modulus and travel, and the modulus each P may mean."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.reading.assessment import ModulusReading
from pipeline.reading.readings import Readings
from pipeline.response.scene_press import ScenePress, spring_shares
from pipeline.verdicts.errors.budget import Budgets, causes_at, ratio_budget
from pipeline.verdicts.errors.cause import Sensor
from pipeline.verdicts.errors.force_ratio import Pressed
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


def reading_table(sensor: Sensor, press: ScenePress) -> ReadingTable:
    """Return the table of the scene; errors of P beyond its mesh's are those of a level sensor at the same press."""
    curve = press.curve
    bands = np.full((2, *curve.P.shape, 2), np.nan)
    for j, travel in enumerate(curve.x.tolist()):
        scale = _Scale(sensor, curve.P[:, j], curve.E)
        for i, E in enumerate(curve.E.tolist()):
            if scale.rises and i > 0 and math.isfinite(curve.P[i, j]):
                at = Pressed(E=E, travel=travel)
                errors = _errors(sensor, press, at, (i, j))
                bands[:, i, j] = [scale.band(float(curve.P[i, j]), error) for error in errors]
    return ReadingTable(response=curve, printed=bands[0], calibrated=bands[1])


def _errors(sensor: Sensor, press: ScenePress, at: Pressed, place: tuple[int, int]) -> tuple[float, float]:
    """Return the whole errors of P [1] at a place of the curve, as printed and after calibrating the unit."""
    relative = np.divide(sensor.own.spring_errors, sensor.own.springs.stiffnesses)
    of_springs = float(spring_shares(sensor.contact, sensor.springs.C, at.E) @ relative)
    numerical = float(press.curve.P_error[place]) + of_springs
    printed = causes_at(sensor, at)
    budgets = [ratio_budget(sensor, at, numerical, causes) for causes in (printed, printed.after_calibration())]
    return budgets[0].total, budgets[1].total


def table_of_readings(curve: SensorResponse, readings: Readings, budgets: Budgets) -> ReadingTable:
    """Return the table of a sensor that reads a modulus at full travel, with two sigma and the bias of its readings.

    As printed its springs are known as well as the print is, after calibrating as the design's reading says.
    """
    rows = readings.assessed.moduli
    bands = np.full((2, *curve.P.shape, 2), np.nan)
    if rows:
        known = np.log([row.E for row in rows])
        for band, widths in zip(bands, (_widths(rows, budgets.widest_spring), _widths(rows, 0.0)), strict=True):
            width = np.interp(np.log(curve.E[1:]), known, widths)
            band[1:, -1] = curve.E[1:, None] * np.stack([1.0 - width, 1.0 + width], axis=1)
    return ReadingTable(response=curve, printed=bands[0], calibrated=bands[1])


def _widths(rows: Sequence[ModulusReading], springs: float) -> list[float]:
    """Return bias and two sigma of the readings [1] whose springs are off by a share [1] beyond calibration."""
    return [abs(row.bias) + math.hypot(2.0 * row.sources.total, springs * row.sources.stiffness_slope) for row in rows]


class _Scale:
    """The modulus over P at one travel, through the two-spring law, under which it is nearly a straight line."""

    def __init__(self, sensor: Sensor, P: Floats, E: Floats) -> None:
        """Take P [1] of the scene at the moduli [MPa], the softest first."""
        self._own, self._softest, self._E = sensor.own, float(P[0]), E
        self._lengths = np.array([self._stiffness(float(one)) for one in P])
        self.rises = bool((np.diff(self._lengths) > 0.0).all())

    def _stiffness(self, P: float) -> float:
        """Return the fruit stiffness that a level sensor has at P, were it 1 on the softest fruit [N/mm].

        It is nan where a tip is off the fruit.
        """
        ratio = P / self._softest * self._own.stiffness_ratio
        return self._own.fruit_stiffness(ratio) if math.isfinite(ratio) else math.nan

    def band(self, P: float, error: float) -> tuple[float, float]:
        """Return the moduli [MPa] that may show P with a relative error [1]."""
        return self.modulus(P * (1.0 - error)), self.modulus(P * (1.0 + error))

    def modulus(self, P: float) -> float:
        """Return the modulus at P [MPa], on the line through the last two beyond the table; nan where there is none."""
        stiffness, known = self._stiffness(P), self._lengths
        if not math.isfinite(stiffness):
            return math.nan
        if stiffness <= known[-1]:
            return float(np.interp(stiffness, known, self._E)) if stiffness > known[0] else 0.0
        slope = (self._E[-1] - self._E[-2]) / (known[-1] - known[-2])
        return float(self._E[-1] + slope * (stiffness - known[-1]))
