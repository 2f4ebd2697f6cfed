"""The readings of a unit at moduli that span the range of its design, and the trims of its leaves."""

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
from sensor.theory.contrast_rise import RiseReading, RiseSlopes, read_rise, select_rise
from solve.contact.linear_response import travels
from solve.contact.relaxing import elastic_forces
from solve.linear import SolveError

MODULI = 7
"""Number of moduli in the table of a unit."""
STEP = 1e-4
"""Relative change of a stiffness in finite differences."""


@dataclass(frozen=True, kw_only=True)
class UnitRow:
    """The forces and the reading of a unit in a level press to full travel, on a fruit of modulus E [MPa].

    `forces` [N] are the tip forces at full travel, and P = F_high / F_low [1]. `u` [1] is the relative half width of E
    at 95 % due to the sources in `error_sources`. `with_design` [1] is the relative error of E if the designed
    stiffnesses are used to read it; it is None if they give no reading.
    """

    E: float = report_field("MPa", "modulus of the fruit", key="E_MPa")
    forces: tuple[float, ...] = report_field("N", "force of each tip", key="F_N")
    P: float = report_field("1", "force ratio")
    u: float = report_field("%", "half width of the error bar of E", key="u_percent", times=100.0)
    with_design: float | None = report_field(
        "%",
        "error of E if it is read with the designed stiffnesses",
        key="with_design_stiffness_percent",
        times=100.0,
    )


def error_sources(sensor: MeasuringUnit) -> str:
    """Return the error sources that apply to a calibrated unit, as a phrase for the heading of its table."""
    unit = sensor.unit
    # Each source is mapped to whether it applies to this unit.
    sources = {
        "the springs": True,
        "their creep": sensor.creep.exponent != 0.0,
        "deflections": unit.calibrated_by == "plate",
        "the form of the domes": bool(sensor.form_deviations(sensor.range_MPa[1])),
        "presses on a ball": unit.ball is not None,
        "bent lines": unit.force_bend is not None or unit.deflection_bend is not None,
    }
    *first_sources, last = (source for source, applies in sources.items() if applies)
    return f"by {', '.join(first_sources)} and {last}" if first_sources else f"by {last} alone"


def unit_table(sensor: MeasuringUnit, nominal: MeasuringUnit) -> tuple[UnitRow, ...]:
    """Simulate the readings of a unit at `MODULI` moduli that span the range of its design, in equal ratios.

    `sensor` is the calibrated unit, and `nominal` is a unit with the designed stiffnesses. Raises ReadingError if a
    press on one of these fruits gives no modulus.
    """
    softest, firmest = sensor.range_MPa
    return tuple(_unit_row(sensor, nominal, E) for E in np.geomspace(softest, firmest, MODULI).tolist())


def _unit_row(sensor: MeasuringUnit, nominal: MeasuringUnit, E: float) -> UnitRow:
    """Simulate a level press of a unit on a fruit of modulus E [MPa], and its reading with the error bar.

    The half width u of the error bar is

        u = k sqrt(c^2 sum s_i^2 + sum f_j^2) + c b,

    with the coverage factor k for 95 %. The standard deviations s_i are due to the springs and deflections, and the
    standard deviations f_j are due to the form of the domes. The error b of bent calibration lines is a bound, so it is
    added linearly. The factor c (`sensor.steepness`) converts a relative change of the uncorrected reading to the
    relative change of E.

    `sensor` is the calibrated unit, and `nominal` is a unit with the designed stiffnesses. Raises ReadingError if the
    press gives no modulus.
    """
    press = level_press(sensor, E)
    full_travel_forces = press[-1]
    groups = sensor.report.design.tips.spring_groups
    low_force = float(full_travel_forces[list(groups.low)].mean())
    high_force = float(full_travel_forces[list(groups.high)].mean())
    with_design = None
    # The forces may have no reading with the designed stiffnesses, if the springs differ much from the design.
    with suppress(ReadingError):
        with_design = nominal.correct_modulus(read_without_noise(nominal, press).E) / E - 1.0
    slopes = read_without_noise(sensor, press).slopes
    bend = sensor.bend_error(slopes.channel_bends, slopes.spring_bends)
    steepness = sensor.steepness(E)
    unit_error = steepness * math.hypot(*_unit_deviations(sensor, slopes))
    u = COVERAGE * math.hypot(unit_error, *sensor.form_deviations(E)) + steepness * bend
    return UnitRow(
        E=E, forces=tuple(full_travel_forces.tolist()), P=high_force / low_force, u=u, with_design=with_design
    )


def level_press(sensor: MeasuringUnit, E: float) -> Floats:
    """Simulate a level press on a fruit of modulus E [MPa], from the first touch to full travel.

    Returns the forces (samples, tips) [N]; the unit reads E from them. Raises ReadingError if a tip is out of contact
    at full travel.
    """
    law, modulus = _level_law(sensor, E)
    # The travel [mm] begins where the tip with the smallest gap touches the fruit.
    travel = min(law.gaps) + travels(sensor.report.design.press.travel_mm, PRESS_SAMPLES)
    msg = f"all tips must touch the fruit in a level press at {E:g} MPa. The springs differ too much from the design."
    try:
        forces = elastic_forces(law, np.full(len(travel), modulus), travel)
    except SolveError as error:
        raise ReadingError(msg) from error
    if not forces[-1].min() > 0.0:
        raise ReadingError(msg)
    return forces


def _level_law(sensor: MeasuringUnit, E: float) -> tuple[ContrastLaw, float]:
    """Return the contact law of a level press by the unit, and the modulus [MPa] that represents E in this law."""
    if sensor.report.read_out.is_pair:
        # The reading of a pair uses only s11 - s12, but a press needs the whole compliance matrix S of the tips. Under
        # a skin, S depends on E.
        S = sensor.report.compliance.at(E).S
        law = ContrastLaw(weights=(-1.0, 1.0), gaps=(0.0, 0.0), C=sensor.C, S=S.tolist())
        return law, E / sensor.press_stiffness_ratio()
    # For other layouts, the press uses the same law as the reading, so its modulus is the reading before correction.
    return sensor.rise_law.contrast, sensor.uncorrected_modulus(E)


def read_without_noise(sensor: MeasuringUnit, press: Floats) -> RiseReading:
    """Read a modulus from the forces (samples, tips) [N] of a press without noise; the reading is uncorrected.

    Raises RiseError if the forces do not determine a modulus.
    """
    tips = press.shape[1]
    return read_rise(sensor.rise_law, select_rise(press, tips, sensor.least_forces), np.zeros(tips))


def _unit_deviations(sensor: MeasuringUnit, slopes: RiseSlopes) -> list[float]:
    """Return the relative standard deviations of a reading [1] due to the springs, their creep, and the deflections.

    Errors of the deflections are included only if the unit was calibrated on a plate. After a calibration by weights,
    the gain errors are part of the error of each reading.
    """
    errors = sensor.channels.spring_and_gain_uncertainty(np.array(slopes.springs), np.array(slopes.gains))
    if sensor.unit.calibrated_by == "plate":
        return list(errors.values())
    return [errors["stiffness"], errors.get("creep", 0.0)]  # springs of metal do not creep


def half_width_by_springs(sensor: MeasuringUnit, slopes: Floats) -> float:
    """Return the half width at 95 % of a quantity due to the errors of the stiffnesses K, in the unit of the quantity.

    `slopes` (tips,) are the derivatives of the quantity with respect to ln K of each spring. The errors of the springs
    are independent.
    """
    return COVERAGE * float(np.linalg.norm(np.multiply(slopes, sensor.unit.K_percent))) * 0.01


def compute_leaf_trims(sensor: MeasuringUnit, targets: Sequence[float]) -> list[float | None]:
    """Return for each tip the change in leaf length [mm] that would give its spring the target stiffness.

    A negative change means that the leaves must be clamped shorter. `targets` (tips,) [N/mm] are the desired
    stiffnesses. The trim is None if the target lies within the error bar (95 %) of the stiffness, because a trim may
    then not improve the spring. The list is empty if the design has no housing.
    """
    housing = sensor.report.housing
    if housing is None:
        return []
    lengths = {arm.name: arm.flexure.length for arm in housing.arms}  # [mm], keyed by the name of the spring
    trims: list[float | None] = []
    springs = zip(sensor.report.tips, sensor.unit.stiffnesses, sensor.unit.K_percent, targets, strict=True)
    for tip, K, percent, target in springs:
        if abs(K - target) <= COVERAGE * 0.01 * percent * K:
            trims.append(None)
            continue
        # The stiffness K of a pair of leaves is proportional to 1 / length^3.
        trims.append(lengths[tip.spring] * (math.cbrt(K / target) - 1.0))
    return trims
