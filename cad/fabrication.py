"""What a maker needs beside the solid: drawing, coupon and a sheet that says how to print and what to measure."""

from pathlib import Path

from cad.coupon import Coupon, coupon_of, coupon_part, largest_weight, modulus_factor
from cad.drafting import write_dxf, write_svg
from cad.drawing import Title, housing_drawing
from cad.export import compare_volume, print_pose, solid_tolerance, step_tolerance
from cad.flexure import Flexure
from cad.materials import Process
from cad.sensor import Body, Sensor
from cad.step import read_step, write_step
from cad.stl import read_stl, write_stl

_COUPON_COLOUR = (0.45, 0.62, 0.35)
_COUPON_SHARE = 0.5  # of the strain limit that the largest weight on a coupon may use
_GRAVITY = 9.80665  # m/s^2, ISO 80000-3
_BUILT_UP = ("fdm", "sla", "sls", "dmls")


def write_fabrication(sensor: Sensor, title: Title, folder: Path) -> tuple[Path, ...]:
    """Write drawing.dxf, drawing.svg, coupon.step, coupon.stl and fabrication.md; return their paths.

    Raises OSError when a file cannot be written, ExportError when one read back has another volume.
    """
    names = ("drawing.dxf", "drawing.svg", "coupon.step", "coupon.stl", "fabrication.md")
    dxf, svg, coupon_step, coupon_stl, sheet = (folder / name for name in names)
    volume = sensor.part.shape.Volume()
    drawing = housing_drawing(sensor.part, sensor.housing, title)
    write_dxf(drawing, dxf)
    write_svg(drawing, svg, title.name)
    coupon = coupon_of(sensor.housing)
    solid = coupon_part(coupon).shape
    write_step((Body(name="coupon", shape=solid, colour=_COUPON_COLOUR),), coupon_step, "coupon")
    compare_volume(coupon_step, read_step(coupon_step).Volume(), solid.Volume(), step_tolerance(solid))
    write_stl(print_pose(solid), coupon_stl)
    compare_volume(coupon_stl, float(read_stl(coupon_stl).volume), solid.Volume(), solid_tolerance(solid))
    sheet.write_text(fabrication_sheet(coupon, title, volume), encoding="utf-8")
    return dxf, svg, coupon_step, coupon_stl, sheet


def fabrication_sheet(coupon: Coupon, title: Title, volume: float) -> str:
    """Return the sheet in Markdown for a housing of the given volume [mm^3]."""
    process = title.process
    return "\n".join(
        (
            f"# {title.name}: how to make it",
            "",
            f"Process {process.name}, {process.material}; {1e-3 * volume:.2f} cm3, "
            f"{1e-3 * volume * process.density_g_per_cm3:.1f} g solid. Files are in millimetres, in print pose.",
            "",
            *_settings(process),
            "",
            "## Measure",
            "",
            f"1. Both leaf thicknesses, at three places each: {coupon.low.thickness:g} mm (L) and "
            f"{coupon.high.thickness:g} mm (H), ±{process.accuracy_mm:g} mm. Stiffness goes with about their cube.",
            "2. The printed modulus, on the coupon (below).",
            "3. Calibrate each unit: press each tip on a balance, read K_l and K_h. Nominal values are not enough.",
            "",
            *_coupon(coupon, process),
            "",
        )
    )


def _settings(process: Process) -> tuple[str, ...]:
    line, layer = process.line_width_mm, process.layer_mm
    tool = "## Print" if process.name.startswith(_BUILT_UP) else "## Make"
    rows = [tool, "", "- Pose: flat, as the files stand; leaves lie in the layers, the marks face up."]
    if line is not None:
        low, high = (leaf / line for leaf in (process.leaf_thickness_low_mm, process.leaf_thickness_high_mm))
        rows.append(f"- Nozzle {line:g} mm, lines {line:g} mm wide: L leaves are {low:.3g} lines, H leaves {high:.3g}.")
    if layer is not None:
        rows.append(f"- Layer {layer:g} mm.")
    rows += [
        f"- Infill 100 %: the modulus, {process.E_MPa:g} MPa, assumes solid leaves. No gap between the lines.",
        f"- No support: overhangs stay within {process.overhang_deg:g} degrees from the vertical, but for 1 mm ledges.",
        f"- Keep {process.min_gap_mm:g} mm gaps open: shuttles must move freely up to their stops.",
        "- Do not round or sand the tip faces: a rounding of 0.1 mm moves the force ratio by about 10 %.",
    ]
    return tuple(rows)


def _coupon(coupon: Coupon, process: Process) -> tuple[str, ...]:
    sides = (("L", coupon.low), ("H", coupon.high))
    return (
        "## Coupon",
        "",
        "Print it beside the housing, with the same settings. Clamp the block; hang a weight F [N] in the hole of one",
        "pad; read how far the hole sinks, d [mm]. Then E = C F / d [MPa], with the thickness t [mm] as measured in",
        "C (t) = C (nominal) x (nominal t / t)^3.",
        "",
        "| leaf | nominal t mm | C 1/mm | largest weight g | it then sinks mm |",
        "|---|---|---|---|---|",
        *(_coupon_row(name, flexure, coupon, process) for name, flexure in sides),
        "",
        "C is that of a slender cantilever with its fillets. A leaf that is wide for its length is stiffer, by at most",
        f"1 / (1 - nu^2) = {1.0 / (1.0 - process.poisson**2):.2f}; a root that gives way is softer by some per cent.",
        "The calibration of the unit has the last word.",
    )


def _coupon_row(name: str, flexure: Flexure, coupon: Coupon, process: Process) -> str:
    factor = modulus_factor(flexure, coupon.arm_beyond_leaf)
    weight = largest_weight(flexure, coupon.arm_beyond_leaf, process.E_MPa, _COUPON_SHARE * process.strain_limit)
    sinks = factor * weight / process.E_MPa
    return f"| {name} | {flexure.thickness:g} | {factor:.5g} | {1e3 * weight / _GRAVITY:.3g} | {sinks:.2f} |"
