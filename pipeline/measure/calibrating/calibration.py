"""From what was measured of a print to its unit: springs by weights, or by readings on rubbers."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from cad.design.reading import Reading
from cad.quantity import InputError
from cad.verdict import Verdict
from pipeline.measure.calibrating.measured_table import MeasuredRow, measured_rows
from pipeline.measure.calibrating.rubbers import springs_on_rubbers
from pipeline.measure.calibrating.trimming import Trim, UnitRow, open_in_words, trims, unit_table
from pipeline.measure.calibrating.unit_verdicts import unit_verdicts
from pipeline.measure.calibrating.weighing import weighed_springs
from pipeline.measure.unit.measuring import LAW_OF_FLESH, MeasuringUnit
from pipeline.measure.unit.printed_unit import PrintedUnit, nominal_unit, unit_of
from pipeline.report.stored import StoredReport


@dataclass(frozen=True, kw_only=True)
class Calibration:
    """A unit with what it shows, whether it meets the targets of its design, and how to trim it where it does not.

    `nominal` are the stiffnesses of the design [N/mm], `assumed` what was taken for granted, `open_by` says what the
    errors of the table count.
    """

    unit: PrintedUnit
    nominal: tuple[float, ...]
    table: tuple[UnitRow, ...]
    verdicts: tuple[Verdict, ...]
    trims: tuple[Trim, ...]
    assumed: tuple[str, ...]
    open_by: str


def is_coupon(rows: Sequence[MeasuredRow]) -> bool:
    """Say whether a table is of a coupon and not of a unit."""
    return "coupon" in rows[0].words


def calibrated(report: StoredReport, path: Path) -> Calibration:
    """Return the calibration of a unit from a table; raises InputError, ReadingError for springs that read nothing."""
    as_designed = MeasuringUnit(report=report, unit=nominal_unit(report))
    unit, assumed = _measured_unit(path, as_designed)
    if as_designed.deep is not None:
        assumed = (*assumed, LAW_OF_FLESH)
    sensor = MeasuringUnit(report=report, unit=unit)
    nominal = as_designed.unit.stiffnesses
    table = unit_table(sensor, as_designed)
    return Calibration(
        unit=unit,
        nominal=nominal,
        table=table,
        verdicts=unit_verdicts(sensor, table),
        trims=trims(sensor, nominal),
        assumed=assumed,
        open_by=open_in_words(sensor),
    )


def _measured_unit(path: Path, as_designed: MeasuringUnit) -> tuple[PrintedUnit, tuple[str, ...]]:
    """Return the unit that a table tells, and what was taken for granted."""
    rows, report = measured_rows(path), as_designed.report
    asked = report.design.reading or Reading()
    if "rubber" in rows[0].words:
        found = springs_on_rubbers(path, rows, as_designed)
        stiffnesses, shares, assumed = found.K, found.shares, found.assumed
        method = "readings on reference rubbers"
    elif "tip" in rows[0].words:
        springs = weighed_springs(path, rows, "tip", [tip.name for tip in report.tips])
        stiffnesses, shares, assumed = tuple(one.K for one in springs), tuple(one.share for one in springs), ()
        method = "weights and deflections"
    else:
        msg = f"{path} line 1: must have a column tip (weights), rubber (readings) or coupon; name what was measured"
        raise InputError(msg)
    percent = [100.0 * share for share in shares]
    unit = unit_of(report, stiffnesses=stiffnesses, percent=percent, method=method, gain_percent=asked.gain_percent)
    return unit, assumed
