"""From what was measured of a print to its unit: springs by weights, or by readings on rubbers; or to its modulus."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from cad.parts.coupon import coupon_of, modulus_factor
from cad.quantity import Estimate, validation_error
from cad.verdict import Verdict
from pipeline.measure.calibrating.rubbers import springs_on_rubbers
from pipeline.measure.calibrating.unit_table import Trim, UnitRow, error_sources, trims, unit_table
from pipeline.measure.calibrating.unit_verdicts import unit_verdicts
from pipeline.measure.calibrating.weighing import weighed_springs
from pipeline.measure.measured_table import FORCE, LENGTH, MODULUS, MeasuredRow, Quantity, place_of, read_table
from pipeline.measure.unit.measuring import LAW_OF_FLESH, MeasuringUnit
from pipeline.measure.unit.printed_unit import PrintedUnit, nominal_unit, unit_of
from pipeline.measure.unit.signals import force_keys
from pipeline.report.stored import StoredReport

_OBJECTS = ("tip", "coupon", "rubber")


@dataclass(frozen=True, kw_only=True)
class Calibration:
    """A unit with what it shows, whether it meets the targets of its design, and how to trim it where it does not.

    `nominal` are the stiffnesses of the design [N/mm], `assumed` what was taken for granted, `error_by` says what the
    errors of the table count.
    """

    unit: PrintedUnit
    nominal: tuple[float, ...]
    table: tuple[UnitRow, ...]
    verdicts: tuple[Verdict, ...]
    trims: tuple[Trim, ...]
    assumed: tuple[str, ...]
    error_by: str


def measured_rows(source: Path | str, report: StoredReport) -> list[MeasuredRow]:
    """Return what was measured of a print of a design: of its tips, on rubbers, or of its coupon; raises InputError."""
    quantities = {name: Quantity(units={}) for name in _OBJECTS}
    quantities |= {
        "force": Quantity(units=FORCE, most=1e3, words=("weight",)),
        "deflection": Quantity(units=LENGTH, most=100.0),
        "E": Quantity(units=MODULUS, most=1e6),
        "E_over_1_minus_nu2": Quantity(units=MODULUS, most=1e6),
        "E_error": Quantity(units={"percent": 0.01}, most=1.0),
        "poisson": Quantity(units={"1": 1.0}, default="1", most=1.0),
        "radius": Quantity(units=LENGTH, most=1e6),
    }
    for key in force_keys(len(report.tips)):
        quantities[key] = Quantity(units=FORCE, most=1e3)
    rows = read_table(source, quantities)
    if len(rows[0].texts) != 1:
        bound = "one column tip (weights), rubber (readings) or coupon"
        raise validation_error(place_of(str(source), 1), ", ".join(rows[0].texts), "", bound, "name what was measured")
    return rows


def calibrated(report: StoredReport, source: Path | str, rows: Sequence[MeasuredRow]) -> Calibration:
    """Return the calibration of a unit; raises InputError, and ReadingError for springs that read nothing."""
    as_designed = MeasuringUnit(report=report, unit=nominal_unit(report))
    assumed: list[str] = []
    if "rubber" in rows[0].texts:
        springs, assumed = springs_on_rubbers(str(source), rows, as_designed)
        method = "readings on reference rubbers"
    else:
        springs = weighed_springs(str(source), rows, "tip", [tip.name for tip in report.tips])
        method = "weights and deflections"
    if as_designed.deep is not None:
        assumed.append(LAW_OF_FLESH)
    unit = unit_of(
        report,
        stiffnesses=[spring.value for spring in springs],
        percent=[spring.percent for spring in springs],
        method=method,
    )
    sensor = MeasuringUnit(report=report, unit=unit)
    nominal = as_designed.unit.stiffnesses
    table = unit_table(sensor, as_designed)
    return Calibration(
        unit=unit,
        nominal=nominal,
        table=table,
        verdicts=unit_verdicts(sensor, table),
        trims=trims(sensor, nominal),
        assumed=tuple(assumed),
        error_by=error_sources(sensor),
    )


def modulus_of_coupon(source: Path | str, rows: Sequence[MeasuredRow], report: StoredReport) -> Estimate:
    """Return the modulus of a print [MPa] with its standard deviation, by the leaves of its coupon; raises InputError.

    The surer leaf counts more.
    """
    if report.housing is None:
        hint = "run pipeline design with springs that print"
        raise validation_error("coupon", None, "", "that of a design with a housing", hint)
    coupon = coupon_of(report.housing)
    weighed = {row.texts["coupon"] for row in rows}
    arms = [arm for arm in coupon.arms if arm.name in weighed] or list(coupon.arms)
    springs = weighed_springs(str(source), rows, "coupon", [arm.name for arm in arms])
    factors = np.array([modulus_factor(arm.flexure, coupon.arm_beyond_leaf) for arm in arms])
    moduli = factors * [spring.value for spring in springs]
    weights = np.array([spring.relative for spring in springs]) ** -2.0
    E = float(np.average(moduli, weights=weights))
    apart = float(weights @ (moduli / E - 1.0) ** 2)
    return Estimate(E, E * math.sqrt((apart + 1.0) / float(weights.sum())), "MPa")
