"""The fabrication sheet, fabrication.md, which explains how to make, finish, measure, wire and mount a sensor."""

import math
from collections.abc import Sequence

from cad.drawing.measuring_table import PIN_FIT, STEP_MM
from cad.drawing.sheet import Title
from cad.fabrication.bill import BillLine, screw_name
from cad.fabrication.mount import FLANGE_CIRCLE_MM, mounted_grip
from cad.fabrication.mount import PLATE_MM as BRACKET_MM
from cad.fabrication.part_sizes import bracket_sizes, cover_sizes
from cad.fabrication.print_bed import GAP_MM
from cad.fabrication.sheet_templates import render_template
from cad.files.slicer_settings import slicer_settings
from cad.parts.assembly import NUT_MM, dowel_length, grip
from cad.parts.coupon import largest_weight, modulus_factor
from cad.parts.cover import COVER_MM, PLATE_MM, RECESS_MM, WASHER_MM
from cad.parts.hall_seats import LEDGE_MM
from cad.parts.housing import DOWEL_MM, Arm
from cad.parts.pin import tip_accuracy_mm
from cad.parts.sensor import SensorSolids
from sensor.design.bench import PRESSED, WEIGHED_AT, Bench
from sensor.design.processes import Process
from sensor.design.readout import PROBE
from sensor.design.signal_path import SpringReadOut, SpringToRead
from sensor.design.tips import represented_by_ball
from sensor.quantity import COVERAGE, STANDARD_GRAVITY
from sensor.theory.straight_line import slope_error_of_resolution

_COUPON_FRACTION = 0.5  # fraction of the strain limit that is reached under the largest weight on a coupon
_SLICER_MASS_RATIO = (0.99, 1.04)  # range of a slicer's mass (100 % infill) divided by the solid mass; see the template
_TORQUE_N_M = 0.5  # causes 0.8 kN per screw and 28 MPa under its washer, half the strength of the softest plastic
# Largest nonlinearity of the field of the two magnets [%] over a length [mm]; the source is in electronics.toml.
_FIELD_LINEARITY_PERCENT, _LINEAR_OVER_MM = 0.3, 0.8
_FEWEST_FRUIT_PRESSES = 2  # a single press does not show a soft spot below one tip
_K_ERROR = 0.01  # largest relative error of a stiffness (95 %) caused by rounded calibration readings
_FIXED_SIZES = {  # sizes [mm], and the fit of a pin, which are the same for all sensors
    "cover": COVER_MM,
    "cover_plate": PLATE_MM,
    "cover_rim": RECESS_MM,
    "ledge": LEDGE_MM,
    "bracket": BRACKET_MM,
    "flange_circle": FLANGE_CIRCLE_MM,
    "nut": NUT_MM,
    "washer": WASHER_MM,
    "dowel": DOWEL_MM,
    "pin_fit": PIN_FIT,
    "plate_gap": GAP_MM,
    "step": STEP_MM,
}


def _coupon_row(arm: Arm, process: Process) -> dict[str, str | float]:
    """Return the table row for the leaf of the coupon that is equal to the leaves of a spring.

    The template refers to the values by their keys. `thickness` [mm] is the thickness of the leaf. `grams` [g] is the
    largest weight on the leaf, and `sag` [mm] the deflection of its hole under this weight. The modulus [MPa] follows
    from a measured force [N] and sag [mm] as E = `factor` [1/mm] * force / sag.
    """
    factor = modulus_factor(arm.flexure)
    force = largest_weight(arm.flexure, process.E_MPa, _COUPON_FRACTION * process.strain_limit)  # [N]
    return {
        "name": arm.name[0].upper(),  # L or H, as engraved on the housing
        "thickness": arm.flexure.thickness,
        "factor": factor,
        "grams": 1e3 * force / STANDARD_GRAVITY,
        "sag": factor * force / process.E_MPa,
    }


def coarsest_resolution(largest_reading: float) -> float:
    """Return the coarsest resolution, rounded down to a power of ten, with which K can be determined to within 1 %.

    The resolution has the unit of `largest_reading`. The 1 % is an expanded uncertainty (95 %), to which force and
    deflection contribute equally.
    """
    # The standard uncertainty of K is _K_ERROR / COVERAGE, and each of the two readings causes 1 / sqrt(2) of it. The
    # error of the slope is proportional to the resolution, so it is computed for a resolution of 1.
    resolution = _K_ERROR / COVERAGE / math.sqrt(2.0) / slope_error_of_resolution(1.0, largest_reading, WEIGHED_AT)
    return 10.0 ** math.floor(math.log10(resolution))


def _calibration_row(spring: SpringToRead, bench: Bench | None) -> dict[str, str | float]:
    """Return the table row for the calibration of a spring.

    The template refers to the values by their keys. `deflection` [mm] and `grams` [g] are the largest deflection and
    the largest weight. `dial` [mm] and `balance` [g] are the resolutions of the dial gauge and the balance on the
    bench. Without a bench, they are the coarsest resolutions with which K can be determined to within 1 %.
    """
    # In a calibration, a spring is loaded less than in use.
    deflection = PRESSED * spring.deflection
    weight_g = 1e3 * PRESSED * spring.force / STANDARD_GRAVITY
    if bench is None:
        dial_mm, balance_g = coarsest_resolution(deflection), coarsest_resolution(weight_g)
    else:
        dial_mm, balance_g = bench.dial_mm, bench.balance_g
    return {
        "name": spring.name,
        "deflection": deflection,
        "grams": weight_g,
        "dial": dial_mm,
        "balance": balance_g,
    }


def fabrication_sheet(
    sensor: SensorSolids,
    title: Title,
    bill: Sequence[BillLine],
    read_out: SpringReadOut,
    plate_size: tuple[float, float],
) -> str:
    """Return the fabrication sheet as Markdown text: the bill, sizes, and instructions for making and calibrating.

    The text comes from the template `fabrication_sheet.md.jinja`, which refers to the values below by their names.
    `title` is the title block of the drawing, with the process. `bill` holds the lines of the bill of materials, and
    `read_out` describes how the springs are read and calibrated. `plate_size` has the sizes of the print plate along
    x and y. Lengths are in mm.
    """
    process = title.process
    volume_cm3 = 1e-3 * sensor.part.shape.Volume()  # from mm^3
    largest_deflection = max(spring.deflection for spring in read_out.springs)
    return render_template(
        "fabrication_sheet.md.jinja",
        title=title,
        sensor=sensor,
        bill=bill,
        read_out=read_out,
        plate_size=[math.ceil(size) for size in plate_size],
        fixed_sizes=_FIXED_SIZES,
        probe=PROBE,
        volume_cm3=volume_cm3,
        mass_g=volume_cm3 * process.density_g_per_cm3,
        slicer_mass_ratio=_SLICER_MASS_RATIO,
        slicer_settings=slicer_settings(process, sensor.housing),
        largest_deflection=largest_deflection,
        # The nonlinearity is proportional to the square of the deflection.
        field_linearity_percent=_FIELD_LINEARITY_PERCENT * (largest_deflection / _LINEAR_OVER_MM) ** 2,
        fruit_presses=max(read_out.presses, _FEWEST_FRUIT_PRESSES),
        printed_depth=process.printed_depth_mm(sensor.housing.depth),
        tip_accuracy=tip_accuracy_mm(sensor.tips, process),
        takes_ball=represented_by_ball(sensor.fruit, sensor.tips),
        coupon_rows=[_coupon_row(arm, process) for arm in sensor.housing.arms],
        cover_sizes=cover_sizes(sensor),
        bracket_sizes=bracket_sizes(sensor),
        screw=screw_name(mounted_grip(sensor)),
        screw_without_bracket=screw_name(grip(sensor)),
        grip_without_bracket=grip(sensor),
        torque_N_m=_TORQUE_N_M,
        dowel_length=dowel_length(sensor.housing),
        calibration_rows=[_calibration_row(spring, read_out.bench) for spring in read_out.springs],
        K_percent=100.0 * _K_ERROR,
        gravity=STANDARD_GRAVITY,
    )
