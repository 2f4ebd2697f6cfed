"""The sheet for the maker, fabrication.md: how to make, finish, measure, wire and mount a sensor."""

import math
import tomllib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from cad.design.processes import Process
from cad.drawing.sheet import Title
from cad.fabrication.bill import Row, bill_table, screw_name
from cad.fabrication.bridges import AMPLIFIER, RESISTANCE_OHM, Bridge, excitation, series_resistor
from cad.fabrication.mount import PLATE_MM, mounted_grip
from cad.parts.assembly import NUT_MM, dowel_length, grip
from cad.parts.coupon import Coupon, coupon_of, largest_weight, modulus_factor
from cad.parts.cover import WASHER_MM
from cad.parts.cover_solid import cover_of
from cad.parts.housing import DOWEL_MM, Housing, mounting_error
from cad.parts.sensor import Sensor
from cad.theory.strain_gauge import GAUGES

_TEXT: dict[str, str] = tomllib.loads(Path(__file__).with_name("fabrication_sheet.toml").read_text(encoding="utf-8"))
_COUPON_SHARE = 0.5  # of the strain limit that the largest weight on a coupon may use
_GRAVITY = 9.80665  # m/s^2, ISO 80000-3
_TORQUE_N_M = 0.5  # 0.8 kN on a screw, 28 MPa under its washer: half of what the softest plastic here bears
_JIG_SHARE = 0.9  # of the largest deflection that a calibration presses
_HEAT = {"17-4PH steel": "heat_17_4ph", "Ti-6Al-4V": "heat_ti64"}  # section of the sheet by material


@dataclass(frozen=True, kw_only=True)
class SheetFacts:
    """What a sheet tells beside the dimensions: the bill and the read-out."""

    bill: tuple[Row, ...]
    bridges: tuple[Bridge, ...]


def fabrication_sheet(sensor: Sensor, title: Title, facts: SheetFacts) -> str:
    """Return the sheet in Markdown."""
    process, housing = title.process, sensor.housing
    return _template(process, housing).format(
        title=title,
        process=process,
        housing=housing,
        gauge=GAUGES[housing.gauges],
        bill=bill_table(facts.bill),
        tool="Make" if process.kind == "other" else "Print",
        lines=[arm.flexure.thickness / (process.line_width_mm or 1.0) for arm in housing.arms],
        coupon_rows=_coupon_rows(coupon_of(housing), process),
        plate_factor=1.0 / (1.0 - process.poisson**2),
        tilt_deg=math.degrees(process.accuracy_mm / housing.spacing),
        **_of_mass(sensor, process),
        **_of_mount(sensor),
        **_of_two_plates(housing, process),
        **_of_readout(facts.bridges, housing, process),
    )


def _of_mass(sensor: Sensor, process: Process) -> dict[str, object]:
    """Return by name volume [cm3] and mass [g] of the housing."""
    volume = 1e-3 * sensor.part.shape.Volume()
    return {"volume_cm3": volume, "mass_g": volume * process.density_g_per_cm3}


def _of_mount(sensor: Sensor) -> dict[str, object]:
    """Return by name what the sheet says of covers, screws, bracket and pins [mm]."""
    housing = sensor.housing
    screw, bare = (screw_name(grip_mm) for grip_mm in (mounted_grip(sensor), grip(sensor)))
    side = housing.pin_side
    return {
        "cover": cover_of(sensor),
        "nut_mm": NUT_MM,
        "bracket_mm": PLATE_MM,
        "screw": screw,
        "bare_screw": bare,
        "torque": _TORQUE_N_M,
        "washer": WASHER_MM,
        "hides": "" if housing.back_to_back else " The front one hides the marks.",
        "pin_section": f"diameter {side:g} mm" if housing.pin_round else f"{side:g} x {side:g} mm",
        "pin_length": housing.pin_out + housing.pocket_depth,
    }


def _of_two_plates(housing: Housing, process: Process) -> dict[str, object]:
    """Return by name what the sheet says of the two plates of a square [mm, deg]."""
    mounting = mounting_error(housing, process.accuracy_mm)
    return {
        "dowel": dowel_length(housing),
        "dowel_diameter": DOWEL_MM,
        "plates_gap": 2.0 * housing.pad_height,
        "mounting": mounting,
        "roll_deg": math.degrees(mounting.roll),
        "turn_deg": math.degrees(mounting.turn),
        "half_accuracy": 0.5 * process.accuracy_mm,
    }


def _of_readout(bridges: Sequence[Bridge], housing: Housing, process: Process) -> dict[str, object]:
    """Return by name what the sheet says of the read-out and of the weights on the balance."""
    return {
        "readout_rows": "\n".join(_readout_row(one, with_noise=housing.gauges != "none") for one in bridges),
        "readout_advice": readout_advice(bridges),
        "amplifier": AMPLIFIER,
        "ohms": RESISTANCE_OHM,
        "excitation": excitation(process),
        "resistor": series_resistor(process),
        "jig_rows": "\n".join(_jig_row(one) for one in bridges),
    }


def _readout_row(bridge: Bridge, *, with_noise: bool) -> str:
    output, full, noise = bridge.output, bridge.full_output, bridge.noise_mN
    cells = [bridge.name, f"{bridge.force:.3g}", f"{bridge.deflection:.3g}"]
    cells += ["no room" if output is None else f"{output:.3g}", "-" if full is None else f"{full:.3g}"]
    if with_noise:
        cells.append("-" if noise is None else f"{noise:.2g}")
    return f"| {' | '.join(cells)} |"


def readout_advice(bridges: Sequence[Bridge]) -> str:
    """Return which read-out fits a sensor without gauges, and with what numbers."""
    least = 10.0 * min(one.deflection for one in bridges)  # a hundredth of it [micrometre]
    if all(one.fits for one in bridges):
        return _TEXT["advice_gauges"].strip()
    short = " and ".join(one.name for one in bridges if not one.fits)
    return _TEXT["advice_displacement"].strip().format(short=short, least=least)


def _jig_row(bridge: Bridge) -> str:
    press = _JIG_SHARE * bridge.deflection
    return f"| {bridge.name} | {press:.3g} | {1e3 * _JIG_SHARE * bridge.force / _GRAVITY:.3g} |"


def _template(process: Process, housing: Housing) -> str:
    """Return the sections of the sheet that this process and this housing ask for."""
    covers, square, gauged = housing.mount == "covers", housing.back_to_back, housing.gauges != "none"
    asked: dict[str, object] = {
        "nozzle": process.line_width_mm,
        "layer": process.layer_mm,
        **{kind: process.kind == kind for kind in ("fdm", "sla", "sls", "dmls")},
        **dict.fromkeys(("heat_17_4ph", "heat_ti64", "heat_other", "advice_gauges", "advice_displacement"), False),
        "cut": process.kind == "dmls",
        "flat_tips": not housing.dome_radius,
        "domes": housing.dome_radius,
        "tips": housing.pin_side,
        "plates": square,
        "cover": covers,
        "covers": covers and not square,
        "washers": not covers and not square,
        "bolts": covers and square,
        "bolts_without_covers": not covers and square,
        "gauges": gauged,
        "readout": gauged,
        "readout_none": not gauged,
        "zero": not square,
        "zero_plates": square,
    }
    if process.kind == "dmls":
        asked[_HEAT.get(process.material, "heat_other")] = True
    return "".join(text for name, text in _TEXT.items() if asked.get(name, True))


def _coupon_rows(coupon: Coupon, process: Process) -> str:
    """Return a row for each leaf: thickness [mm], factor [1/mm], largest weight [g], how far it sinks [mm]."""
    rows, beyond, strain = [], coupon.arm_beyond_leaf, _COUPON_SHARE * process.strain_limit
    for arm in coupon.arms:
        factor = modulus_factor(arm.flexure, beyond)
        force = largest_weight(arm.flexure, beyond, process.E_MPa, strain)
        weight, sinks = 1e3 * force / _GRAVITY, factor * force / process.E_MPa
        name, thickness = arm.name[0].upper(), arm.flexure.thickness
        rows.append(f"| {name} | {thickness:g} | {factor:.5g} | {weight:.3g} | {sinks:.2f} |")
    return "\n".join(rows)
