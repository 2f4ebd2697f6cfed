"""`pipeline modulus`: compression tests of fruit, force over travel, to the modulus that a sensor is designed for."""

from argparse import ArgumentParser, Namespace
from pathlib import Path
from typing import TYPE_CHECKING

from cad.quantity import validation_error
from pipeline.commands.console import PASSED, add_force_flag, add_json_flag, answering, number, print_json

if TYPE_CHECKING:
    from pipeline.measure.compression.force_law import TestGeometry
    from pipeline.measure.measured_table import Quantity

PURPOSE = "turn compression tests into the modulus of the fruit"
EXAMPLE = "pipeline modulus mango-1.csv mango-2.csv --height 70 --radius 35"

PAPER_HEIGHT_MM = 70.0  # of the paper's fruit, 65 to 70 mm
PAPER_PLATE_MM2 = 900.0  # of the paper's plate, 30 x 30 mm
POISSON = 0.3  # of fruit.poisson too
PLATES = {"plate": 2, "seat": 1}
SUPPORTS = {"plate": "a plate: above and below each take half the travel", "seat": "a seat that gives nothing"}
PLOT_KINDS = {".svg": "svg", ".png": "png"}


def add_arguments(parser: ArgumentParser) -> None:
    """Add FILE and the flags on fruit, plates, units and output."""
    add = parser.add_argument
    add("files", metavar="FILE", nargs="+", type=Path, help="CSV with force and travel, or an export of TRAPEZIUM X")
    add(
        "--height",
        metavar="MM",
        type=number,
        help="height of the fruit along the press [mm] (default twice the radius)",
    )
    add(
        "--radius", metavar="MM", type=number, help="its radius where a plate touches it [mm] (default half the height)"
    )
    add(
        "--radius-across", metavar="MM", type=number, help="the other radius of curvature there [mm] (default the same)"
    )
    add("--poisson", metavar="NU", type=number, help="Poisson's ratio of the flesh (default 0.3)")
    add("--support", choices=tuple(PLATES), default="plate", help="under the fruit: a plate, or a fitting seat")
    add(
        "--plate-area", metavar="MM2", type=number, help="area that the paper's modulus divides by [mm^2] (default 900)"
    )
    add("--strain", metavar="PERCENT", default="5,2,10", help="strains of secant and tangent [%%] (default 5,2,10)")
    add("--columns", metavar="NAME=HEADER,...", help="headers that are not understood, as in force=Last,travel=Pfad")
    add("--units", metavar="NAME=UNIT,...", help="units where the file gives none, as in force=kN,travel=um")
    add("--force-unit", metavar="UNIT", help="unit of the force where the file gives none (N, kN, kgf, ...)")
    add("--travel-unit", metavar="UNIT", help="unit of the travel where the file gives none (mm, um, in, ...)")
    add("--compression-negative", action="store_true", help="the machine counts compression negative: turn the signs")
    add("--per", choices=("file", "folder"), default="file", help="what holds the tests of one fruit (default file)")
    add("--plot", metavar="FILE", type=Path, help="draw curves and fits into an SVG or PNG file")
    add_force_flag(parser)
    add_json_flag(parser)


def execute(arguments: Namespace) -> int:
    """Print the moduli of every specimen in the files; return exit code 0."""
    from pipeline.measure.compression.modulus import measured_modulus
    from pipeline.measure.compression.specimens import read_specimens
    from pipeline.measure.compression.summary import design_range, fruit_summaries, print_results, result_mapping

    _refuse_plot(arguments.plot)
    geometry, assumed = _geometry(arguments)
    quantities = _quantities(arguments)
    results = []
    for file in dict.fromkeys(arguments.files):
        for specimen in read_specimens(file, quantities):
            results.append(measured_modulus(specimen, geometry, compression_negative=arguments.compression_negative))
    if arguments.plot is not None:
        from pipeline.measure.compression.plot import plotted
        from pipeline.storage.files import write_files

        path: Path = arguments.plot
        content = plotted(results, PLOT_KINDS[path.suffix.lower()])
        write_files({path: content}, "--plot", force=arguments.force, renew=True)
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
    if path.suffix.lower() not in PLOT_KINDS:
        raise validation_error("--plot", str(path), "", f"a file that ends in {' or '.join(PLOT_KINDS)}", "rename it")
    if path.is_dir():
        raise validation_error("--plot", str(path), "", "a file, and it is a folder", "name a file in it")


def _quantities(arguments: Namespace) -> "dict[str, Quantity]":
    """Return what headers mean, with what the flags say of them and of their units."""
    from pipeline.measure.compression.specimens import QUANTITIES
    from pipeline.measure.measured_table import quantities_by_flags, with_unit

    quantities = quantities_by_flags(QUANTITIES, arguments.columns, arguments.units)
    for name, unit in (("force", arguments.force_unit), ("travel", arguments.travel_unit)):
        if unit is not None:
            quantities[name] = with_unit(quantities[name], unit, f"--{name}-unit")
    return quantities


def _geometry(arguments: Namespace) -> tuple["TestGeometry", list[str]]:
    """Return the fruit and the plates of the test, and a sentence on each number that no flag gives."""
    from pipeline.measure.compression.force_law import TestGeometry

    height = arguments.height
    radius = arguments.radius
    across = arguments.radius_across
    area = arguments.plate_area
    poisson = arguments.poisson
    assumed = []
    if height is None and radius is None:
        height = PAPER_HEIGHT_MM
        assumed.append(f"no --height and no --radius: the paper's fruit, {height:g} mm high, is assumed")
    if radius is None:
        radius = 0.5 * height
        assumed.append(f"no --radius: half the height, {radius:g} mm, is assumed")
    if height is None:
        height = 2.0 * radius
        assumed.append(f"no --height: twice the radius, {height:g} mm, is assumed")
    if across is None:
        across = radius
        assumed.append(f"no --radius-across: a ball there, {radius:g} mm both ways, is assumed")
    if area is None:
        area = PAPER_PLATE_MM2
        assumed.append(f"no --plate-area: the paper's plate, {area:g} mm^2, is assumed")
    assumed.append(f"--support {arguments.support}: under the fruit is {SUPPORTS[arguments.support]}")
    if poisson is None:
        poisson = POISSON
        assumed.append(f"no --poisson: a Poisson's ratio of {poisson:g} is assumed")
    geometry = TestGeometry(
        height_mm=height,
        radius_mm=radius,
        radius_across_mm=across,
        poisson=poisson,
        plate_area_mm2=area,
        plates=PLATES[arguments.support],
        strains_percent=_strains(arguments.strain),
    )
    return geometry, assumed


def _strains(text: str) -> tuple[float, ...]:
    try:
        return tuple(number(part) for part in text.split(","))
    except ValueError as error:
        raise validation_error(
            "--strain", text, "%", "numbers parted by commas", "write for instance --strain 5,2,10"
        ) from error
