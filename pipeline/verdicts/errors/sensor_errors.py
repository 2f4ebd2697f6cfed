"""All that is said of a sensor's errors: the budget of each number, the table with its bands, the scatter of prints."""

from dataclasses import dataclass

from pipeline.options import RunOptions
from pipeline.reading.readings import Readings
from pipeline.response.scene_press import ScenePress
from pipeline.verdicts.errors.budget import Budgets, uncertainty_budgets
from pipeline.verdicts.errors.cause import Sensor
from pipeline.verdicts.errors.print_scatter import ScatterBands, print_scatter
from pipeline.verdicts.errors.reading_table import ReadingTable, reading_table, table_of_readings
from pipeline.verdicts.scene_targets import SceneTargets


@dataclass(frozen=True, kw_only=True)
class SensorErrors:
    """The budgets, the table that a user reads, and how far prints scatter where fabrication was asked for."""

    budgets: Budgets
    reading: ReadingTable
    scatter: ScatterBands | None


def sensor_errors(
    sensor: Sensor, reached: SceneTargets, press: ScenePress, options: RunOptions, readings: Readings | None = None
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
