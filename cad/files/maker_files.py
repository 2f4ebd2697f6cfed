"""What a maker needs beside the solid: drawing, coupon, cover, and a sheet on how to print and what to measure."""

from pathlib import Path

import cadquery as cq

from cad.design.processes import Process
from cad.files.drafting import write_dxf, write_svg
from cad.files.drawing import Title, housing_drawing
from cad.files.sensor_files import export_step, export_stl, print_pose
from cad.parts.coupon import Coupon, coupon_of, coupon_part, largest_weight, modulus_factor
from cad.parts.cover import Cover, cover_findings, cover_of, cover_part
from cad.parts.housing import Housing
from cad.parts.sensor import Body, Colour, Sensor
from cad.theory.flexure import Flexure
from cad.theory.strain_gauge import GAUGES
from cad.verdict import Verdict

_COUPON_COLOUR = (0.45, 0.62, 0.35)
_COVER_COLOUR = (0.60, 0.60, 0.62)
_COUPON_SHARE = 0.5  # of the strain limit that the largest weight on a coupon may use
_GRAVITY = 9.80665  # m/s^2, ISO 80000-3
_NUT_MM = 2.4  # of M3, ISO 4032
_SCREWS_MM = (10, 12, 16, 20, 25, 30, 35, 40, 45, 50)  # lengths of M3, ISO 4762
_BUILT_UP = ("fdm", "sla", "sls", "dmls")


def write_fabrication(sensor: Sensor, title: Title, folder: Path) -> tuple[tuple[Path, ...], tuple[Verdict, ...]]:
    """Write drawing.dxf/.svg, coupon and cover as .step/.stl, fabrication.md; return their paths and cover findings.

    Raises OSError when a file cannot be written, ExportError when one read back has another volume.
    """
    dxf, svg, sheet = (folder / name for name in ("drawing.dxf", "drawing.svg", "fabrication.md"))
    drawing = housing_drawing(sensor.part, sensor.housing, title)
    write_dxf(drawing, dxf)
    write_svg(drawing, svg, title.name)
    coupon, cover = coupon_of(sensor.housing), cover_of(sensor)
    of_coupon, _ = _write_solid(coupon_part(coupon).shape, folder / "coupon", _COUPON_COLOUR)
    of_cover, made = _write_solid(cover_part(cover).shape, folder / "cover", _COVER_COLOUR)
    sheet.write_text(fabrication_sheet(coupon, cover, title, sensor.part.shape.Volume()), encoding="utf-8")
    return (dxf, svg, *of_coupon, *of_cover, sheet), cover_findings(sensor, made, title.process)


def _write_solid(solid: cq.Shape, path: Path, colour: Colour) -> tuple[tuple[Path, Path], cq.Shape]:
    """Write a solid [mm] as STEP, and as STL in print pose; return their paths and what the STEP file holds."""
    step, stl = path.with_suffix(".step"), path.with_suffix(".stl")
    made = export_step((Body(name=path.name, shape=solid, colour=colour),), step)
    export_stl(print_pose(solid), stl)
    return (step, stl), made


def fabrication_sheet(coupon: Coupon, cover: Cover, title: Title, volume: float) -> str:
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
            *_pins(cover.housing),
            *_cover(cover),
            "",
            *_gauges(cover.housing),
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


def _pins(housing: Housing) -> tuple[str, ...]:
    if not housing.pin_side:
        return ()
    side, length = housing.pin_side, housing.pin_out + housing.pocket_depth
    section = f"diameter {side:g} mm" if housing.pin_round else f"{side:g} x {side:g} mm"
    return (
        "## Tips",
        "",
        f"Two ground steel pins, {section}, {length:g} mm long, their ends as in pin.step: one in each foot.",
        f"Pockets are {housing.pocket_side:g} mm wide and {housing.pocket_depth:g} mm deep; their gable stays empty.",
        "Fill them with a hard epoxy, put both pins face down on a flat plate, their sides along the housing, the feet",
        f"{housing.pin_out:g} mm above the plate, and let it set: both faces are then level. A soft or thick glue",
        "gives way: calibrate with the pins in.",
        "",
    )


def _cover(cover: Cover) -> tuple[str, ...]:
    screw = next((length for length in _SCREWS_MM if length >= cover.grip + _NUT_MM), None)
    with_nut = f"M3 x {screw}" if screw else "threaded rod"
    return (
        "## Cover",
        "",
        "Print cover.stl twice, flat as it stands, rim up, in any solid or filled setting: front and back are equal.",
        f"Each is {cover.plate:g} mm with a rim of {cover.recess:g} mm that rests on the frame alone; tips and necks",
        "stay free below. The front one hides the marks.",
        f"Four M3 screws go through covers and housing: {cover.grip:g} mm to grip (plate {cover.housing.depth:g} + two "
        f"covers of {cover.thickness:g});",
        f"with a nut ({_NUT_MM:g} mm) {with_nut}. Calibrate with the covers on.",
    )


def _gauges(housing: Housing) -> tuple[str, ...]:
    gauge = GAUGES[housing.gauges]
    if gauge is None:
        return ()
    return (
        "## Strain gauges",
        "",
        f"Eight foil gauges, grid {gauge.grid_length_mm:g} x {gauge.grid_width_mm:g} mm, gauge factor "
        f"{gauge.gauge_factor:g}, polyimide backing trimmed to",
        f"{gauge.backing_length_mm:g} x {gauge.backing_width_mm:g} mm, metal {gauge.margin_mm:g} mm inside its edges. "
        "Glue them as drawing.dxf and .svg show: on the",
        "upper leaf of each spring one on each face at each root, in the middle of the depth, grid towards the root,",
        f"edge of the backing where the fillet ends, {housing.low.fillet:g} mm from wall or shuttle. Nothing is",
        "engraved in a leaf: mark it with a pencil.",
        "Wire the four of a spring as a full bridge: the two faces of a root, and the same face at the two roots, in",
        "neighbouring arms. Lead the shuttle's wires, thin and loose, along the leaf to the wall. Length and",
        "stiffness in this folder are those with the gauges on; a spring without them is softer. Calibrate with them.",
        "",
    )
