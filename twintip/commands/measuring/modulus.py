"""`pipeline modulus`: compression tests of fruit, force over travel, to the modulus that a sensor is designed for."""

from argparse import ArgumentParser, Namespace
from pathlib import Path
from typing import TYPE_CHECKING

from sensor.quantity import InputError, validation_error
from twintip.commands.console import PASSED, add_force_flag, add_json_flag, answering, number, print_error, print_json

if TYPE_CHECKING:
    from instrument.compress.bodies import CompressedBody, Plunger
    from instrument.compress.force_law import TestGeometry
    from instrument.compress.sizes import SpecimenSizes

PURPOSE = "turn compression tests into the modulus of the fruit"
EXAMPLE = "pipeline modulus mango-1.csv mango-2.csv --height 70 --radius 35"

PAPER_PLATE_MM2 = 900.0  # of the paper's plate, 30 x 30 mm
POISSON = 0.3  # of fruit.poisson too
PLATES = {"plate": 2, "table": 2, "seat": 1}
BODIES = ("ball", "ellipsoid", "cylinder-end", "cylinder-side", "block")
SIZES = ("height", "radius", "radius_across", "length", "width")
_BALL_IN_RADII = {"ball": {"height_mm": 2.0, "radius_across_mm": 1.0}, "ellipsoid": {"radius_across_mm": 1.0}}
"""Sizes that may be left out, in radii of the body: those of a ball."""


def add_arguments(parser: ArgumentParser) -> None:
    """Add FILE and the flags on fruit, plates, units and output."""
    add = parser.add_argument
    add("files", metavar="FILE", nargs="*", type=Path, help="a table of force and travel, CSV or XLSX, as exported")
    alone = "with --radius alone: a ball, or an ellipsoid"
    add("--body", choices=BODIES, metavar="BODY", help=f"what is pressed, one of {', '.join(BODIES)} ({alone})")
    add("--height", metavar="MM", type=number, help="its height along the press [mm]")
    add("--radius", metavar="MM", type=number, help="its radius, or that of its curvature where a plate touches [mm]")
    add("--radius-across", metavar="MM", type=number, help="the other radius of curvature there [mm]")
    add("--length", metavar="MM", type=number, help="length of a cylinder on its side, or of a block [mm]")
    add("--width", metavar="MM", type=number, help="width of a block [mm]")
    add("--sizes", metavar="FILE", type=Path, help="a table of file, height, radius, ... [mm]: sizes of each specimen")
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
    add("--compliance", metavar="UM/N", type=number, default=0.0, help="of frame and load cell, as measured [um/N]")
    add("--compliance-error", metavar="UM/N", type=number, help="how far that may be off (default a tenth of it)")
    add("--strain", metavar="PERCENT", default="5,2,10", help="strains of secant and tangent [%%] (default 5,2,10)")
    add("--columns", metavar="NAME=HEADER,...", help="headers, or numbers of columns, as in force=Last,travel=3")
    add("--units", metavar="NAME=UNIT,...", help="units where the file gives none, as in force=kN,travel=um")
    add("--compression-negative", action="store_true", help="the machine counts compression negative: turn the signs")
    add("--per", choices=("file", "folder"), default="file", help="what holds the tests of one fruit (default file)")
    add("--plot", metavar="FILE", type=Path, help="draw curves and fits as one web page (FILE.html)")
    add_force_flag(parser)
    add_json_flag(parser)


def execute(arguments: Namespace) -> int:
    """Print the moduli of every specimen in the files; return exit code 0."""
    from dataclasses import replace

    from instrument.compress.modulus import measured_modulus
    from instrument.compress.specimens import QUANTITIES, read_specimens
    from instrument.compress.summary import design_range, fruit_summaries, print_results
    from pipeline.storage.told import as_data
    from pipeline.tables.headers import ColumnFlags
    from solve.linear import SolveError

    _refuse_plot(arguments.plot)
    sizes = _sizes(arguments)
    files = arguments.files or ([] if sizes is None else sizes.files)
    if not files:
        raise validation_error("FILE", None, "", "given, or named by the table of --sizes", "name a file")
    told: tuple[TestGeometry, list[str]] | None = None if sizes else _geometry(arguments)
    quantities = ColumnFlags(arguments.columns, arguments.units).applied(QUANTITIES)
    results = []
    try:
        for file in dict.fromkeys(files):
            for specimen in read_specimens(file, quantities):
                given = {} if sizes is None else sizes.sizes_of(specimen)
                geometry, assumed = told or _geometry(Namespace(**{**vars(arguments), **given}))
                found = measured_modulus(specimen, geometry, compression_negative=arguments.compression_negative)
                results.append(replace(found, notes=(*assumed, *found.notes)))
    except SolveError as error:
        raise InputError(str(error)) from error
    if arguments.plot is not None:
        from instrument.compress.page import modulus_page
        from pipeline.storage.files import write_files

        page = modulus_page(results)
        write_files({arguments.plot: page.encode()}, "--plot", force=arguments.force)
    with answering():
        if arguments.json:
            print_json(as_data(results))
        else:
            fruit = fruit_summaries(results, by_folder=arguments.per == "folder")
            print_results(results, fruit, design_range(results))
    return PASSED


def _sizes(arguments: Namespace) -> "SpecimenSizes | None":
    """Return the table of --sizes; raises InputError for a size that a flag gives as well."""
    if arguments.sizes is None:
        return None
    from instrument.compress.sizes import measured_sizes

    names = (*SIZES, "plunger_radius")
    sizes = measured_sizes(arguments.sizes, [name for name in names if getattr(arguments, name) is not None])
    print_error(f"note: {sizes.understood}")
    return sizes


def _refuse_plot(path: Path | None) -> None:
    if path is not None and (path.suffix.lower() != ".html" or path.is_dir()):
        bound = "the name of a file that ends in .html, and no folder"
        raise validation_error("--plot", str(path), "", bound, "write for instance fruit.html")


def _geometry(arguments: Namespace) -> tuple["TestGeometry", list[str]]:
    """Return the body and the tools of the test, and a sentence on each assumption where no flag says."""
    from instrument.compress.force_law import TestGeometry

    assumed: list[str] = []
    body = _body(arguments, assumed)
    plunger = _plunger(arguments)
    support = arguments.support
    if support is None and arguments.body is None and plunger is None:
        support = "plate"
        assumed.append("no --body and no --plunger: a plate above and a plate below are assumed")
    if support is None:
        raise validation_error("--support", None, "", f"one of {', '.join(PLATES)}", "choose what is under the body")
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
        compliance_um_per_N=arguments.compliance,
        compliance_error_um_per_N=_compliance_error(arguments),
    )
    return geometry, assumed


def _body(arguments: Namespace, assumed: list[str]) -> "CompressedBody":
    """Return the body that is pressed, and add to `assumed` a sentence on each size that no flag gives.

    Raises InputError where its kind or a size is missing, or a size is given that it does not have.
    """
    from dataclasses import fields

    from instrument.compress.bodies import KINDS

    sizes = {f"{name}_mm": getattr(arguments, name) for name in SIZES if getattr(arguments, name) is not None}
    kind = arguments.body
    if kind is None:
        if arguments.radius is None:
            raise validation_error("--body", None, "", f"one of {', '.join(BODIES)}", "choose what is pressed")
        kind = "ball" if arguments.height is None else "ellipsoid"
    of_a_ball = _BALL_IN_RADII.get(kind, {})
    needed = {item.name for item in fields(KINDS[kind])}
    missing = needed - sizes.keys() - of_a_ball.keys()
    not_its_own = sizes.keys() - needed - of_a_ball.keys()
    for name in sorted(missing | not_its_own):
        bound = f"{'given' if name in missing else 'left out'} for --body {kind}"
        raise validation_error(_flag(name), sizes.get(name), "mm", bound, "measure what the body has")
    for name in sorted(of_a_ball.keys() - sizes.keys()):
        sizes[name] = of_a_ball[name] * sizes["radius_mm"]
        assumed.append(f"no {_flag(name)}: that of a ball, {sizes[name]:g} mm, is assumed")
    return KINDS[kind](**sizes)


def _compliance_error(arguments: Namespace) -> float:
    """Return how far the compliance may be off [um/N]; raises InputError where only that is given."""
    error: float | None = arguments.compliance_error
    if error is not None and not arguments.compliance:
        bound = "given together with --compliance"
        raise validation_error("--compliance-error", error, "um/N", bound, "give both, or neither")
    return 0.1 * arguments.compliance if error is None else error


def _flag(size: str) -> str:
    return "--" + size.removesuffix("_mm").replace("_", "-")


def _plunger(arguments: Namespace) -> "Plunger | None":
    """Return the plunger that presses in place of a plate, None without; raises InputError where half is given."""
    from instrument.compress.bodies import Plunger

    radius = arguments.plunger_radius
    end = arguments.plunger
    if end is None and radius is None:
        return None
    if end is None or radius is None:
        missing = "--plunger" if end is None else "--plunger-radius"
        raise validation_error(
            missing,
            None,
            "",
            "given together with the other flag of the plunger",
            "give --plunger and --plunger-radius, or neither",
        )
    return Plunger(radius_mm=radius, ball=end == "ball")


def _strains(text: str) -> tuple[float, ...]:
    try:
        return tuple(number(part) for part in text.split(","))
    except ValueError as error:
        hint = "write for instance --strain 5,2,10"
        raise validation_error("--strain", text, "%", "numbers parted by commas", hint) from error
