"""`pipeline modulus`: from compression tests of fruit, force over travel, to the modulus for a design."""

from argparse import Namespace
from collections.abc import Mapping
from dataclasses import fields, replace
from pathlib import Path

from instrument.compress.force_law import TestGeometry
from instrument.compress.modulus import measured_modulus
from instrument.compress.modulus_page import modulus_page
from instrument.compress.pressed_shapes import KINDS, CompressedBody, Plunger
from instrument.compress.sizes import SIZES, read_sizes_table
from instrument.compress.specimens import QUANTITIES, read_specimens
from instrument.compress.summary import design_range, fruit_summaries, result_parts
from pipeline.storage.files import write_files
from pipeline.storage.record_data import as_data
from pipeline.storage.stopwatch import Count
from pipeline.tables.headers import ColumnFlags
from sensor.quantity import InputError, validation_error
from solve.linear import SolveError
from twintip.commands.console import PASSED, Answer, print_error
from twintip.commands.progress import Work, showing_progress
from twintip.flags import BODIES, SUPPORTS, number

PAPER_PLATE_MM2 = 900.0  # the paper's plate of 30 x 30 mm
POISSON = 0.3  # also the default of fruit.poisson
_BALL_IN_RADII = {"ball": {"height": 2.0, "radius_across": 1.0}, "ellipsoid": {"radius_across": 1.0}}
"""Optional sizes in radii of the body; the defaults are those of a ball."""

Sizes = Mapping[str, float]
"""Sizes of a test [mm] by the names of their flags."""


def run(arguments: Namespace) -> Answer:
    """Find the modulus of every specimen in the files, and summarise the specimens of each fruit.

    The forces of each body are solved by finite elements once, however many specimens share its sizes.
    """
    _check_plot(arguments.plot)
    given = {name: getattr(arguments, name) for name in SIZES if getattr(arguments, name) is not None}
    table = None if arguments.sizes is None else read_sizes_table(arguments.sizes, list(given))
    if table is not None:
        print_error(f"note: {table.understood}")
    files = arguments.files or ([] if table is None else table.files)
    if not files:
        raise validation_error("FILE", None, "", "given, or named by the table of --sizes", "name a file")
    shared_geometry = None if table else _test_geometry(arguments, given)
    quantities = ColumnFlags(arguments.columns, arguments.units).applied(QUANTITIES)
    tests = []
    for file in dict.fromkeys(files):
        for specimen in read_specimens(file, quantities):
            sizes = given if table is None else {**given, **table.sizes_of(specimen)}
            tests.append((specimen, *(shared_geometry or _test_geometry(arguments, sizes))))
    bodies = list(dict.fromkeys(geometry for _, geometry, _ in tests))  # each body is solved once
    results = []
    try:
        with showing_progress("solves how the body is pressed") as work:
            for specimen, geometry, assumed in tests:
                count = _body_counter(work, bodies.index(geometry), len(bodies))
                result = measured_modulus(
                    specimen, geometry, compression_negative=arguments.compression_negative, count=count
                )
                results.append(replace(result, notes=(*assumed, *result.notes)))
    except SolveError as error:
        raise InputError(str(error)) from error
    if arguments.plot is not None:
        page = modulus_page(results)
        write_files({arguments.plot: page.encode()}, "--plot", force=arguments.force)
    fruit = fruit_summaries(results, by_folder=arguments.per == "folder")
    parts = result_parts(results, fruit, design_range(results))
    return Answer(code=PASSED, data=as_data(results), parts=parts)


def _body_counter(work: Work, body: int, bodies: int) -> Count:
    """Return a progress callback for one of several bodies, which reports its parts within the total of all bodies."""
    return lambda ended, parts: work.count(body * parts + ended, bodies * parts)


def _check_plot(path: Path | None) -> None:
    if path is not None and (path.suffix.lower() != ".html" or path.is_dir()):
        bound = "the name of a file that ends in .html, and no folder"
        raise validation_error("--plot", str(path), "", bound, "write for instance fruit.html")


def _test_geometry(arguments: Namespace, sizes: Sizes) -> tuple[TestGeometry, list[str]]:
    """Return the body and tools of a test, with a sentence on each assumption made where a flag is missing."""
    assumed: list[str] = []
    body = _compressed_body(arguments.body, sizes, assumed)
    plunger = _plunger(arguments.plunger, sizes)
    support = arguments.support
    if support is None and arguments.body is None and plunger is None:
        support = "plate"
        assumed.append("no --body and no --plunger: a plate above and a plate below are assumed")
    if support is None:
        raise validation_error("--support", None, "", f"one of {', '.join(SUPPORTS)}", "choose what is under the body")
    area = arguments.plate_area
    if area is None:
        area = body.end_area_mm2 or PAPER_PLATE_MM2
        of = "the area of the end" if body.end_area_mm2 else "the area of the paper's plate"
        assumed.append(f"no --plate-area: {of}, {area:.4g} mm^2, is assumed")
    poisson = arguments.poisson
    if poisson is None:
        poisson = POISSON
        assumed.append(f"no --poisson: a Poisson's ratio of {poisson:g} is assumed")
    error = arguments.compliance_error
    if error is not None and not arguments.compliance:
        bound = "given together with --compliance"
        raise validation_error("--compliance-error", error, "um/N", bound, "give both, or neither")
    geometry = TestGeometry(
        body=body,
        plunger=plunger,
        plates=1 if support == "seat" else 2,
        poisson=poisson,
        poisson_error=arguments.poisson_error,
        plate_area_mm2=area,
        strains_percent=_parse_strains(arguments.strain),
        compliance_um_per_N=arguments.compliance,
        compliance_error_um_per_N=0.1 * arguments.compliance if error is None else error,
    )
    return geometry, assumed


def _compressed_body(kind: str | None, sizes: Sizes, assumed: list[str]) -> CompressedBody:
    """Return the compressed body, and append to `assumed` a sentence on each size that no flag gives.

    Raises InputError if its kind or a size is missing, and for a size that it does not have.
    """
    if kind is None:
        if "radius" not in sizes:
            raise validation_error("--body", None, "", f"one of {', '.join(BODIES)}", "choose what is pressed")
        kind = "ellipsoid" if "height" in sizes else "ball"
    given = {name: size for name, size in sizes.items() if name != "plunger_radius"}
    ball_defaults = _BALL_IN_RADII.get(kind, {})
    needed = {item.name.removesuffix("_mm") for item in fields(KINDS[kind])}
    missing = needed - given.keys() - ball_defaults.keys()
    for name in sorted(missing | (given.keys() - needed)):
        bound = f"{'given' if name in missing else 'left out'} for --body {kind}"
        raise validation_error(_flag(name), given.get(name), "mm", bound, "measure what the body has")
    for name in sorted(ball_defaults.keys() - given.keys()):
        given[name] = ball_defaults[name] * given["radius"]
        assumed.append(f"no {_flag(name)}: {given[name]:g} mm, as for a ball, is assumed")
    return KINDS[kind](**{f"{name}_mm": size for name, size in given.items()})


def _flag(size: str) -> str:
    return f"--{size.replace('_', '-')}"


def _plunger(end: str | None, sizes: Sizes) -> Plunger | None:
    """Return the plunger that replaces a plate, or None; raises InputError for incomplete flags."""
    radius = sizes.get("plunger_radius")
    if end is None and radius is None:
        return None
    if end is None or radius is None:
        missing = "--plunger" if end is None else "--plunger-radius"
        bound = "given together with the other flag of the plunger"
        raise validation_error(missing, None, "", bound, "give --plunger and --plunger-radius, or neither")
    return Plunger(radius_mm=radius, ball=end == "ball")


def _parse_strains(text: str) -> tuple[float, ...]:
    try:
        return tuple(number(part) for part in text.split(","))
    except ValueError as error:
        hint = "write for instance --strain 5,2,10"
        raise validation_error("--strain", text, "%", "numbers separated by commas", hint) from error
