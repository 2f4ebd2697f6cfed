"""`pipeline modulus`: compression tests of fruit, force over travel, to the modulus that a sensor is designed for."""

from argparse import ArgumentParser, Namespace
from pathlib import Path
from typing import TYPE_CHECKING

from cad.quantity import validation_error
from pipeline.commands.console import PASSED, add_force_flag, add_json_flag, answering, number, print_json

if TYPE_CHECKING:
    from pipeline.measure.compression.bodies import Body, Plunger
    from pipeline.measure.compression.force_law import TestGeometry

PURPOSE = "turn compression tests into the modulus of the fruit"
EXAMPLE = "pipeline modulus mango-1.csv mango-2.csv --height 70 --radius 35"

PAPER_PLATE_MM2 = 900.0  # of the paper's plate, 30 x 30 mm
POISSON = 0.3  # of fruit.poisson too
PLATES = {"plate": 2, "table": 2, "seat": 1}
SIZES = {
    "ball": ("radius",),
    "ellipsoid": ("height", "radius"),
    "cylinder-end": ("height", "radius"),
    "cylinder-side": ("radius", "length"),
    "block": ("height", "width", "length"),
}
"""The flags that each body needs."""
OPTIONAL_SIZES = {"ball": ("height", "radius_across"), "ellipsoid": ("radius_across",)}


def add_arguments(parser: ArgumentParser) -> None:
    """Add FILE and the flags on fruit, plates, units and output."""
    add = parser.add_argument
    add("files", metavar="FILE", nargs="+", type=Path, help="CSV with force and travel, or an export of TRAPEZIUM X")
    bodies = ", ".join(SIZES)
    alone = "with --radius alone: a ball, or an ellipsoid"
    add("--body", choices=tuple(SIZES), metavar="BODY", help=f"what is pressed, one of {bodies} ({alone})")
    add("--height", metavar="MM", type=number, help="its height along the press [mm]")
    add("--radius", metavar="MM", type=number, help="its radius, or that of its curvature where a plate touches [mm]")
    add("--radius-across", metavar="MM", type=number, help="the other radius of curvature there [mm]")
    add("--length", metavar="MM", type=number, help="length of a cylinder on its side, or of a block [mm]")
    add("--width", metavar="MM", type=number, help="width of a block [mm]")
    add("--plunger", choices=("flat", "ball"), help="end of the plunger that presses instead of a plate")
    add("--plunger-radius", metavar="MM", type=number, help="radius of the plunger, or of its ball [mm]")
    add("--support", choices=tuple(PLATES), help="under the body: a plate, a table, or a seat that gives nothing")
    add("--poisson", metavar="NU", type=number, help="Poisson's ratio of the flesh (default 0.3)")
    add("--poisson-error", metavar="NU", type=number, default=0.05, help="how far that may be off (default 0.05)")
    add(
        "--plate-area",
        metavar="MM2",
        type=number,
        help="area that the paper's modulus divides by [mm^2] (default 900, or that of a flat end)",
    )
    add("--strain", metavar="PERCENT", default="5,2,10", help="strains of secant and tangent [%%] (default 5,2,10)")
    add("--columns", metavar="NAME=HEADER,...", help="headers that are not understood, as in force=Last,travel=Pfad")
    add("--units", metavar="NAME=UNIT,...", help="units where the file gives none, as in force=kN,travel=um")
    add("--compression-negative", action="store_true", help="the machine counts compression negative: turn the signs")
    add("--per", choices=("file", "folder"), default="file", help="what holds the tests of one fruit (default file)")
    add("--plot", metavar="FILE", type=Path, help="draw curves and fits as one web page (FILE.html)")
    add_force_flag(parser)
    add_json_flag(parser)


def execute(arguments: Namespace) -> int:
    """Print the moduli of every specimen in the files; return exit code 0."""
    from pipeline.measure.compression.modulus import measured_modulus
    from pipeline.measure.compression.specimens import QUANTITIES, read_specimens
    from pipeline.measure.compression.summary import design_range, fruit_summaries, print_results, result_mapping
    from pipeline.measure.measured_table import quantities_by_flags

    _refuse_plot(arguments.plot)
    geometry, assumed = _geometry(arguments)
    quantities = quantities_by_flags(QUANTITIES, arguments.columns, arguments.units)
    results = []
    for file in dict.fromkeys(arguments.files):
        for specimen in read_specimens(file, quantities):
            results.append(measured_modulus(specimen, geometry, compression_negative=arguments.compression_negative))
    if arguments.plot is not None:
        from pipeline.measure.compression.page import modulus_page
        from pipeline.storage.files import write_files

        page = modulus_page(results)
        write_files({arguments.plot: page.encode()}, "--plot", force=arguments.force, renew=True)
    with answering():
        if arguments.json:
            print_json([result_mapping(result, assumed) for result in results])
        else:
            fruit = fruit_summaries(results, by_folder=arguments.per == "folder")
            print_results(results, fruit, design_range(results), assumed)
    return PASSED


def _refuse_plot(path: Path | None) -> None:
    if path is None:
        return
    if path.suffix.lower() != ".html":
        hint = f"write {path.with_suffix('.html').name}"
        raise validation_error("--plot", str(path), "", "a file name that ends in .html", hint)
    if path.is_dir():
        raise validation_error("--plot", str(path), "", "a file, and it is a folder", "name a file in it")


def _geometry(arguments: Namespace) -> tuple["TestGeometry", list[str]]:
    """Return the body and the tools of the test, and a sentence on each thing that no flag gives."""
    from pipeline.measure.compression.force_law import TestGeometry

    assumed: list[str] = []
    body = _body(arguments, assumed)
    plunger = _plunger(arguments)
    support = arguments.support
    if support is None and arguments.body is None and plunger is None:
        support = "plate"
        assumed.append("no --body and no --plunger: a plate above and a plate below are assumed")
    if support is None:
        raise validation_error("--support", "none", "", f"one of {', '.join(PLATES)}", "say what is under the body")
    area = arguments.plate_area
    if area is None:
        area = body.end_area_mm2 or PAPER_PLATE_MM2
        of = "that of the end" if body.end_area_mm2 else "the paper's plate"
        assumed.append(f"no --plate-area: {of}, {area:.4g} mm^2, is assumed")
    poisson = arguments.poisson
    if poisson is None:
        poisson = POISSON
        assumed.append(f"no --poisson: a Poisson's ratio of {poisson:g} is assumed")
    geometry = TestGeometry(
        body=body,
        plunger=plunger,
        plates=PLATES[support],
        poisson=poisson,
        poisson_error=arguments.poisson_error,
        plate_area_mm2=area,
        strains_percent=_strains(arguments.strain),
    )
    return geometry, assumed


def _body(arguments: Namespace, assumed: list[str]) -> "Body":
    """Return what is pressed; raises InputError where its name or a size is missing, or a size is not its own."""
    from pipeline.measure.compression.bodies import Block, CylinderOnEnd, CylinderOnSide, Ellipsoid

    names = ("height", "radius", "radius_across", "length", "width")
    sizes = {name: getattr(arguments, name) for name in names if getattr(arguments, name) is not None}
    kind = arguments.body
    if kind is None:
        if "radius" not in sizes:
            raise validation_error("--body", "none", "", f"one of {', '.join(SIZES)}", "say what is pressed")
        kind = "ellipsoid" if "height" in sizes else "ball"
    _refuse_sizes(kind, sizes)
    if "radius" in sizes and kind in OPTIONAL_SIZES:
        for name, size in (("height", 2.0 * sizes["radius"]), ("radius_across", sizes["radius"])):
            if name not in sizes:
                sizes[name] = size
                assumed.append(f"no --{name.replace('_', '-')}: that of a ball, {size:g} mm, is assumed")
    bodies = {"cylinder-end": CylinderOnEnd, "cylinder-side": CylinderOnSide, "block": Block}
    body: Body = bodies.get(kind, Ellipsoid)(**{f"{name}_mm": size for name, size in sizes.items()})
    return body


def _refuse_sizes(kind: str, sizes: dict[str, float]) -> None:
    for name in SIZES[kind]:
        if name not in sizes:
            bound = f"given for --body {kind}"
            raise validation_error("--" + name, "none", "mm", bound, "measure it on the fruit")
    for name, size in sizes.items():
        if name not in SIZES[kind] + OPTIONAL_SIZES.get(kind, ()):
            bound = f"left out for --body {kind}"
            raise validation_error("--" + name.replace("_", "-"), size, "mm", bound, "it has no such size")


def _plunger(arguments: Namespace) -> "Plunger | None":
    from pipeline.measure.compression.bodies import Plunger

    radius = arguments.plunger_radius
    if arguments.plunger is None:
        if radius is not None:
            raise validation_error("--plunger", "none", "", "flat or ball", "say which end the plunger has")
        return None
    if radius is None:
        raise validation_error("--plunger-radius", "none", "mm", "given with --plunger", "measure the plunger")
    return Plunger(radius_mm=radius, ball=arguments.plunger == "ball")


def _strains(text: str) -> tuple[float, ...]:
    try:
        return tuple(number(part) for part in text.split(","))
    except ValueError as error:
        raise validation_error(
            "--strain", text, "%", "numbers parted by commas", "write for instance --strain 5,2,10"
        ) from error
