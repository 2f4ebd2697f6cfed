"""The readings of a unit over the range of its design, and trims of its leaves."""

import math
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass

import numpy as np

from instrument.press.measuring import MeasuringUnit
from sensor.arrays import Floats
from sensor.design.reading import PRESS_SAMPLES
from sensor.quantity import COVERAGE, report_field
from sensor.theory.contrast_law import ContrastLaw, ReadingError
from sensor.theory.contrast_rise import RiseReading, RiseSlopes, read_rise, rise_of
from solve.contact.linear_response import travels
from solve.contact.relaxing import elastic_forces
from solve.linear import SolveError

MODULI = 7
STEP = 1e-4
"""Relative step of a stiffness for finite differences."""


@dataclass(frozen=True, kw_only=True)
class UnitRow:
    """The forces and the reading of a level unit on a fruit of modulus E [MPa], pressed to full travel.

    `forces` [N] are the tip forces at full travel, and P = F_high / F_low [1]. `u` is the half width of E at 95 % due
    to the sources in `error_sources` [1]. `with_design` is the relative error of E if it is read with the stiffnesses
    of the design [1], None if they give no reading.
    """

    E: float = report_field("MPa", "modulus of the fruit", key="E_MPa")
    forces: tuple[float, ...] = report_field("N", "force of each tip", key="F_N")
    P: float = report_field("1", "force ratio")
    u: float = report_field("%", "half width of the error bar of E", key="u_percent", times=100.0)
    with_design: float | None = report_field(
        "%",
        "error of E with the stiffnesses of the design",
        key="with_design_stiffness_percent",
        times=100.0,
    )


def error_sources(sensor: MeasuringUnit) -> str:
    """Return as text the error sources that apply to a calibrated unit, for the heading of its table."""
    unit = sensor.unit
    sources = {
        "the springs": True,
        "their creep": sensor.creep.exponent != 0.0,
        "deflections": unit.calibrated_by == "plate",
        "the form of the domes": bool(sensor.form_deviations(sensor.range_MPa[1])),
        "presses on a ball": unit.ball is not None,
        "bent lines": unit.force_bend is not None or unit.deflection_bend is not None,
    }
    *first_sources, last = (words for words, applies in sources.items() if applies)
    return f"by {', '.join(first_sources)} and {last}" if first_sources else f"by {last} alone"


def unit_table(sensor: MeasuringUnit, nominal: MeasuringUnit) -> tuple[UnitRow, ...]:
    """Return the readings of a unit at `MODULI` moduli over the range of its design.

    `nominal` is the unit exactly as designed. Raises ReadingError if a press on one of these fruits gives no modulus.
    """
    softest, firmest = sensor.range_MPa
    rows = []
    for E in np.geomspace(softest, firmest, MODULI).tolist():
        press = level_press(sensor, E)
        low, high = (float(press[-1, list(group)].mean()) for group in sensor.report.design.tips.spring_groups)
        with_design = None
        with suppress(ReadingError):  # the designed stiffnesses may give no reading of a very different unit
            with_design = nominal.corrected(read_exactly(nominal, press).E) / E - 1.0
        slopes = read_exactly(sensor, press).slopes
        bend = sensor.bend_error(slopes.channel_bends, slopes.spring_bends)
        steepness = sensor.steepness(E)
        unit_error = steepness * math.hypot(*_unit_deviations(sensor, slopes))
        u = COVERAGE * math.hypot(unit_error, *sensor.form_deviations(E)) + steepness * bend
        rows.append(UnitRow(E=E, forces=tuple(press[-1].tolist()), P=high / low, u=u, with_design=with_design))
    return tuple(rows)


def level_press(sensor: MeasuringUnit, E: float) -> Floats:
    """Return the forces of a level unit on a fruit of modulus E [MPa], from the first touch to full travel.

    The corrected reading of these forces (samples, tips) [N] is E. Raises ReadingError if a tip is out of contact at
    full travel.
    """
    law, modulus = _level_law(sensor, E)
    travel = min(law.gaps) + travels(sensor.report.design.press.travel_mm, PRESS_SAMPLES)  # from the first touch
    msg = f"a level press at {E:g} MPa: must have every tip on the fruit; its springs are too far from the design"
    try:
        forces = elastic_forces(law, np.full(len(travel), modulus), travel)
    except SolveError as error:
        raise ReadingError(msg) from error
    if not forces[-1].min() > 0.0:
        raise ReadingError(msg)
    return forces


def _level_law(sensor: MeasuringUnit, E: float) -> tuple[ContrastLaw, float]:
    """Return the contact law of a level press by the unit, and the modulus [MPa] to use in that law for a true E."""
    if sensor.report.read_out.is_pair:
        # The law of a pair contains only s11 - s12. A press needs the whole compliance, which differs under a skin.
        S = sensor.report.compliance.at(E).S
        law = ContrastLaw(weights=(-1.0, 1.0), gaps=(0.0, 0.0), C=sensor.C, S=S.tolist())
        return law, E / sensor.press_over_weighed()
    # Other layouts are pressed by the law that reads them, with the modulus before correction.
    return sensor.rise_law.contrast, sensor.read_as(E)


def read_exactly(sensor: MeasuringUnit, press: Floats) -> RiseReading:
    """Return the uncorrected reading by a unit of forces without noise (samples, tips) [N].

    Raises RiseError if they determine no modulus.
    """
    tips = press.shape[1]
    return read_rise(sensor.rise_law, rise_of(press, tips, sensor.least_forces), np.zeros(tips))


def _unit_deviations(sensor: MeasuringUnit, slopes: RiseSlopes) -> list[float]:
    """Return the relative standard deviations of a reading [1] due to springs, their creep, and deflections.

    Deflections count only if a plate calibrated the unit. The gain errors of weights belong to the error of a reading.
    """
    errors = sensor.channels.spring_and_gain_uncertainty(np.array(slopes.springs), np.array(slopes.gains))
    on_plate = sensor.unit.calibrated_by == "plate"
    return list(errors.values()) if on_plate else [errors["stiffness"], errors.get("creep", 0.0)]


def error_by_springs(sensor: MeasuringUnit, slopes: Floats) -> float:
    """Return the half width at 95 % of a value due to the errors of the stiffnesses K, in the unit of the value.

    `slopes` (tips,) are the slopes of the value against ln K.
    """
    return COVERAGE * float(np.linalg.norm(np.multiply(slopes, sensor.unit.K_percent))) * 0.01


def trims(sensor: MeasuringUnit, targets: Sequence[float]) -> list[float | None]:
    """Return the length [mm] to add to the leaves of each tip's spring; a negative one means clamping them shorter.

    `targets` [N/mm] are the desired stiffnesses. The trim is None if the target lies within the error (95 %) of the
    spring, because no cut is known to improve it. The list is empty if the design has no housing.
    """
    housing = sensor.report.housing
    if housing is None:
        return []
    lengths = {arm.name: arm.flexure.length for arm in housing.arms}
    lengthenings: list[float | None] = []
    for tip, K, percent, target in zip(
        sensor.report.tips, sensor.unit.stiffnesses, sensor.unit.K_percent, targets, strict=True
    ):
        if abs(K - target) <= COVERAGE * 0.01 * percent * K:
            lengthenings.append(None)
            continue
        # K of a pair of leaves is proportional to L^-3.
        lengthenings.append(lengths[tip.spring] * (math.cbrt(K / target) - 1.0))
    return lengthenings
