"""The sheet for the maker, fabrication.md: how to make, finish, measure, wire and mount a sensor."""

import math
import tomllib
from collections.abc import Sequence
from pathlib import Path

from cad.design.processes import Process
from cad.drawing.sheet import Title
from cad.fabrication.bill import Row, as_markdown, bill_table, screw_name
from cad.fabrication.bridges import (
    HX711,
    RESISTANCE_OHM,
    Bridge,
    SignalPath,
    excitation,
    largest_excitation,
    series_resistor,
)
from cad.fabrication.mount import PLATE_MM, mounted_grip
from cad.parts.assembly import NUT_MM, dowel_length, grip
from cad.parts.coupon import Coupon, coupon_of, largest_weight, modulus_factor
from cad.parts.cover import WASHER_MM
from cad.parts.cover_solid import cover_of
from cad.parts.housing import DOWEL_MM, Housing, mounting_error
from cad.parts.sensor import Sensor
from cad.quantity import COVERAGE
from cad.theory.strain_gauge import GAUGES

_TEXT: dict[str, str] = tomllib.loads(Path(__file__).with_name("fabrication_sheet.toml").read_text(encoding="utf-8"))
_COUPON_FRACTION = 0.5  # of the strain limit that the largest weight on a coupon may use
_GRAVITY = 9.80665  # m/s^2, ISO 80000-3
_TORQUE_N_M = 0.5  # 0.8 kN on a screw, 28 MPa under its washer: half of what the softest plastic here bears
_K_ERROR = 0.01  # of a stiffness (95 %), what rounded readings of a calibration may make of it
_JIG_FRACTION = 0.9  # of the largest deflection that a calibration presses
_HEAT = {"17-4PH steel": "heat_17_4ph", "Ti-6Al-4V": "heat_ti64"}  # section of the sheet by material


def fabrication_sheet(
    sensor: Sensor, title: Title, bill: Sequence[Row], bridges: Sequence[Bridge], signal: SignalPath | None = None
) -> str:
    """Return the sheet in Markdown: dimensions, the bill, and the read-out by the bridges or by a signal path."""
    process = title.process
    housing = sensor.housing
    has_gauges = housing.gauges != "none"
    mounting = mounting_error(housing, process.accuracy_mm)
    volume_cm3 = 1e-3 * sensor.part.shape.Volume()
    side = housing.pin_side
    return _template(process, housing, signal).format(
        title=title,
        process=process,
        material=as_markdown(process.material),
        housing=housing,
        gauge=GAUGES[housing.gauges],
        gauge_count=4 * len(sensor.tips.springs),
        bill=bill_table(bill),
        tool="Make" if process.kind == "other" else "Print",
        lines=[arm.flexure.thickness / (process.line_width_mm or 1.0) for arm in housing.arms],
        coupon_rows=_coupon_rows(coupon_of(housing), process),
        plate_factor=1.0 / (1.0 - process.poisson**2),
        tilt_deg=math.degrees(process.accuracy_mm / housing.spacing),
        volume_cm3=volume_cm3,
        mass_g=volume_cm3 * process.density_g_per_cm3,
        # covers, screws, bracket and pins
        cover=cover_of(sensor),
        nut_mm=NUT_MM,
        bracket_mm=PLATE_MM,
        screw=screw_name(mounted_grip(sensor)),
        bare_screw=screw_name(grip(sensor)),
        torque=_TORQUE_N_M,
        washer=WASHER_MM,
        hides="" if housing.back_to_back else " The front one hides the marks.",
        pin_section=f"diameter {side:g} mm" if housing.pin_round else f"{side:g} x {side:g} mm",
        pin_length=housing.pin_out + housing.pocket_depth,
        # the two plates of a square
        dowel=dowel_length(housing),
        dowel_diameter=DOWEL_MM,
        plates_gap=2.0 * housing.pad_height,
        mounting=mounting,
        roll_deg=math.degrees(mounting.roll),
        turn_deg=math.degrees(mounting.turn),
        half_accuracy=0.5 * process.accuracy_mm,
        # the read-out, and the weights on the balance
        readout_rows="\n".join(_readout_row(bridge, with_noise=has_gauges) for bridge in bridges),
        readout_advice=readout_advice(bridges),
        amplifier=HX711,
        ohms=RESISTANCE_OHM,
        excitation=excitation(process),
        largest_excitation=largest_excitation(process),
        resistor=series_resistor(process),
        signal=signal,
        signal_rows="" if signal is None else _signal_rows(sensor.tips.names, signal),
        name=title.name,
        jig_rows="\n".join(_jig_row(bridge) for bridge in bridges),
    )


def _table_row(*cells: str) -> str:
    return f"| {' | '.join(cells)} |"


def _signal_rows(names: Sequence[str], signal: SignalPath) -> str:
    """Return a row for each channel: counts per newton and at full load, noise and drift of zero [mN], gain [%]."""
    rows = []
    for i, name in enumerate(names):
        output = f"{signal.mV_per_V[i]:.3g}" if signal.mV_per_V else "-"
        cells = [f"{signal.counts_per_N[i]:.4g}", f"{signal.full_counts[i]:.4g}", f"{1e3 * signal.noise_N[i]:.2g}"]
        cells += [f"{1e3 * signal.zero_drift_N[i]:.2g}", f"{signal.gain_drift_percent[i]:.2g}"]
        rows.append(_table_row(name, output, *cells))
    return "\n".join(rows)


def _readout_row(bridge: Bridge, *, with_noise: bool) -> str:
    cells = [bridge.name, f"{bridge.force:.3g}", f"{bridge.deflection:.3g}"]
    cells.append("no room" if bridge.output is None else f"{bridge.output:.3g}")
    cells.append("-" if bridge.full_output is None else f"{bridge.full_output:.3g}")
    if with_noise:
        cells.append("-" if bridge.noise_mN is None else f"{bridge.noise_mN:.2g}")
    return _table_row(*cells)


def readout_advice(bridges: Sequence[Bridge]) -> str:
    """Return which read-out fits a sensor without gauges, and with what numbers."""
    if all(bridge.fits for bridge in bridges):
        return _TEXT["advice_gauges"].strip()
    short = " and ".join(bridge.name for bridge in bridges if not bridge.fits)
    least = 10.0 * min(bridge.deflection for bridge in bridges)  # a hundredth of it [micrometre]
    return _TEXT["advice_displacement"].strip().format(short=short, least=least)


def _jig_row(bridge: Bridge) -> str:
    """Return how far a spring is pressed in a calibration [mm], what the balance shows [g], and both last digits."""
    deflection = _JIG_FRACTION * bridge.deflection
    grams = 1e3 * _JIG_FRACTION * bridge.force / _GRAVITY
    last_digits = [f"{last_digit(full):g}" for full in (deflection, grams)]
    return _table_row(bridge.name, f"{deflection:.3g}", f"{grams:.3g}", *last_digits)


def last_digit(full: float) -> float:
    """Return the coarsest power of ten to which readings up to a full one may be rounded, in its unit, for K to 1 %.

    Six readings from none to the full one: their squares about the mean add up to 0.7 of its square. A last digit r has
    the standard deviation r / sqrt(12) (JCGM 100:2008, F.2.2.1); 95 % of 1 % is shared by force and deflection.
    """
    largest = _K_ERROR / COVERAGE * full * math.sqrt(12.0 * 0.7 / 2.0)
    return 10.0 ** math.floor(math.log10(largest))


def _template(process: Process, housing: Housing, signal: SignalPath | None) -> str:
    """Return the sections of the sheet that this process and this housing ask for; one without a rule is in all."""
    has_covers = housing.mount == "covers"
    is_square = housing.back_to_back
    has_gauges = housing.gauges != "none"
    wanted: dict[str, object] = {
        "nozzle": process.line_width_mm,
        "layer": process.layer_mm,
        "cut": process.kind == "dmls",
        "flat_tips": not housing.dome_radius,
        "domes": housing.dome_radius,
        "tips": housing.pin_side,
        "plates": is_square,
        "cover": has_covers,
        "covers": has_covers and not is_square,
        "washers": not has_covers and not is_square,
        "bolts": has_covers and is_square,
        "bolts_without_covers": not has_covers and is_square,
        "gauges": has_gauges,
        "readout": has_gauges,
        "readout_none": not has_gauges and signal is None,
        "probes": signal is not None and signal.transducer == "displacement",
        "signal": signal is not None,
        "commands": signal is not None,
        "zero": not is_square,
        "zero_plates": is_square,
        "advice_gauges": False,  # in the text of the read-out
        "advice_displacement": False,
    }
    for kind in ("fdm", "sla", "sls", "dmls"):
        wanted[kind] = process.kind == kind
    heat = _HEAT.get(process.material, "heat_other") if process.kind == "dmls" else ""
    for section in (*_HEAT.values(), "heat_other"):
        wanted[section] = section == heat
    return "".join(text for section, text in _TEXT.items() if wanted.get(section, True))


def _coupon_rows(coupon: Coupon, process: Process) -> str:
    """Return a row for each leaf: thickness [mm], factor [1/mm], largest weight [g], how far it sinks [mm]."""
    rows = []
    beyond = coupon.arm_beyond_leaf
    for arm in coupon.arms:
        factor = modulus_factor(arm.flexure, beyond)
        force = largest_weight(arm.flexure, beyond, process.E_MPa, _COUPON_FRACTION * process.strain_limit)
        grams = 1e3 * force / _GRAVITY
        sag = factor * force / process.E_MPa
        name = arm.name[0].upper()
        rows.append(_table_row(name, f"{arm.flexure.thickness:g}", f"{factor:.5g}", f"{grams:.3g}", f"{sag:.2f}"))
    return "\n".join(rows)
