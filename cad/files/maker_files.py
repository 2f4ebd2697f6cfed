"""What a maker needs beside the solid: drawing, coupon, cover, and a sheet on how to print and what to measure."""

import math
import tomllib
from pathlib import Path

import cadquery as cq

from cad.design.processes import Process
from cad.files.drafting import write_dxf, write_svg
from cad.files.drawing import Title, housing_drawing
from cad.files.sensor_files import export_step, export_stl
from cad.parts.assembly import COVER_COLOUR, NUT_MM, dowel_length, mounting_error, screw_length
from cad.parts.coupon import Coupon, coupon_of, coupon_part, largest_weight, modulus_factor
from cad.parts.cover import WASHER_MM, Cover, cover_of, cover_part
from cad.parts.housing import DOWEL_MM, Housing
from cad.parts.pose import print_pose
from cad.parts.sensor import Body, Colour, Sensor
from cad.theory.strain_gauge import GAUGES

_TEXT: dict[str, str] = tomllib.loads(Path(__file__).with_name("fabrication_sheet.toml").read_text(encoding="utf-8"))
_COUPON_COLOUR = (0.45, 0.62, 0.35)
_COUPON_SHARE = 0.5  # of the strain limit that the largest weight on a coupon may use
_GRAVITY = 9.80665  # m/s^2, ISO 80000-3
_TORQUE_N_M = 0.5  # 0.8 kN on a screw, 28 MPa under its washer: half of what the softest plastic here bears
_BUILT_UP = ("fdm", "sla", "sls", "dmls")


def write_fabrication(sensor: Sensor, title: Title, folder: Path) -> tuple[tuple[Path, ...], cq.Shape]:
    """Write drawing.dxf/.svg, coupon and cover as .step/.stl, fabrication.md; return paths and the cover read back.

    Raises OSError when a file cannot be written, ExportError when one read back has another volume.
    """
    dxf, svg, sheet = (folder / name for name in ("drawing.dxf", "drawing.svg", "fabrication.md"))
    drawing = housing_drawing(sensor.part, sensor.housing, title)
    write_dxf(drawing, dxf)
    write_svg(drawing, svg, title.name)
    coupon, cover = coupon_of(sensor.housing), cover_of(sensor)
    of_coupon, _ = _write_solid(coupon_part(coupon).shape, folder / "coupon", _COUPON_COLOUR)
    of_cover, cover_read = _write_solid(cover_part(cover).shape, folder / "cover", COVER_COLOUR)
    sheet.write_text(fabrication_sheet(coupon, cover, title, sensor.part.shape.Volume()), encoding="utf-8")
    return (dxf, svg, *of_coupon, *of_cover, sheet), cover_read


def _write_solid(solid: cq.Shape, path: Path, colour: Colour) -> tuple[tuple[Path, Path], cq.Shape]:
    """Write a solid [mm] as STEP, and as STL in print pose; return their paths and what the STEP file holds."""
    step, stl = path.with_suffix(".step"), path.with_suffix(".stl")
    made = export_step((Body(name=path.name, shape=solid, colour=colour),), step)
    export_stl(print_pose(solid), stl)
    return (step, stl), made


def fabrication_sheet(coupon: Coupon, cover: Cover, title: Title, volume: float) -> str:
    """Return the sheet in Markdown for a housing of the given volume [mm^3]."""
    process, housing, gauge = title.process, cover.housing, GAUGES[cover.housing.gauges]
    side, length = housing.pin_side, screw_length(cover.grip)
    return _template(process, housing).format(
        title=title,
        process=process,
        housing=housing,
        cover=cover,
        gauge=gauge,
        volume_cm3=1e-3 * volume,
        mass_g=1e-3 * volume * process.density_g_per_cm3,
        tool="Print" if process.name.startswith(_BUILT_UP) else "Make",
        lines=[arm.flexure.thickness / (process.line_width_mm or 1.0) for arm in housing.arms],
        coupon_rows=_coupon_rows(coupon, process),
        plate_factor=1.0 / (1.0 - process.poisson**2),
        pin_section=f"diameter {side:g} mm" if housing.pin_round else f"{side:g} x {side:g} mm",
        pin_length=housing.pin_out + housing.pocket_depth,
        nut_mm=NUT_MM,
        screw="threaded rod" if length is None else f"M3 x {length}",
        torque=_TORQUE_N_M,
        tilt_deg=math.degrees(process.accuracy_mm / housing.spacing),
        washer=WASHER_MM,
        hides="" if housing.back_to_back else " The front one hides the marks.",
        **_of_two_plates(housing, process),
    )


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


def _template(process: Process, housing: Housing) -> str:
    """Return the sections of the sheet that this process and this housing ask for."""
    covers, square = housing.mount == "covers", housing.back_to_back
    asked = {
        "nozzle": process.line_width_mm,
        "layer": process.layer_mm,
        "flat_tips": not housing.dome_radius,
        "domes": housing.dome_radius,
        "tips": housing.pin_side,
        "plates": square,
        "cover": covers,
        "covers": covers and not square,
        "washers": housing.mount == "washers" and not square,
        "bolts": covers and square,
        "bolts_without_covers": housing.mount == "washers" and square,
        "gauges": housing.gauges != "none",
        "zero": not square,
        "zero_plates": square,
    }
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
