"""`pipeline modulus`: the modulus of fruit from compression tests, which record force against travel."""

from argparse import Namespace
from collections.abc import Mapping, Sequence
from dataclasses import fields, replace
from pathlib import Path
from typing import NamedTuple

from instrument.compress.force_law import TestGeometry
from instrument.compress.modulus import CompressionResult, measure_modulus
from instrument.compress.modulus_page import modulus_page
from instrument.compress.pressed_shapes import KINDS, CompressedBody, Plunger
from instrument.compress.sizes import SIZES, read_sizes_table
from instrument.compress.specimens import QUANTITIES, Specimen, read_specimens
from instrument.compress.summary import find_design_range, fruit_summaries, result_parts
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
_COMPLIANCE_ERROR = 0.1  # relative error of the compliance of the machine, if --compliance-error is not given
_DEFAULT_SIZES_IN_RADII = {"ball": {"height": 2.0, "radius_across": 1.0}, "ellipsoid": {"radius_across": 1.0}}
"""Default sizes of a body, as multiples of its radius. They are the sizes of a ball."""

Sizes = Mapping[str, float]
"""Sizes of a test [mm] by the names of their flags."""


class _CompressionTest(NamedTuple):
    """A specimen, the geometry of its test, and a sentence for each assumption about this geometry."""

    specimen: Specimen
    geometry: TestGeometry
    assumptions: list[str]


def run(arguments: Namespace) -> Answer:
    """Find the modulus of every specimen in the files, and summarise the specimens of each fruit.

    With `--plot`, a page with plots of all tests is written too.
    """
    _check_plot(arguments.plot)
    tests = _compression_tests(arguments)
    results = _solve_moduli(tests, compression_negative=arguments.compression_negative)
    if arguments.plot is not None:
        page = modulus_page(results)
        write_files({arguments.plot: page.encode()}, "--plot", force=arguments.force)
    fruit = fruit_summaries(results, by_folder=arguments.per == "folder")
    parts = result_parts(results, fruit, find_design_range(results))
    return Answer(code=PASSED, data=as_data(results), parts=parts)


def _compression_tests(arguments: Namespace) -> list[_CompressionTest]:
    """Read every specimen in the files, and combine it with the geometry of its test.

    The sizes of the specimens come from the flags and from the table of `--sizes`. The table also names the files if no
    other files are given. A note on the table is printed to stderr. Raises InputError if no file is given, or if a size
    or another flag of the test is missing or superfluous.
    """
    sizes_of_flags = {name: getattr(arguments, name) for name in SIZES if getattr(arguments, name) is not None}
    table = None if arguments.sizes is None else read_sizes_table(arguments.sizes, list(sizes_of_flags))
    if table is not None:
        print_error(f"note: {table.summary}")
    files = arguments.files
    if not files and table is not None:
        files = table.files
    if not files:
        raise validation_error("FILE", None, "", "given, or named in the table of --sizes", "name a file")
    # Without a table of sizes, all tests have the same geometry. Its flags are checked before the files are read.
    shared_geometry = None if table else _test_geometry(arguments, sizes_of_flags)
    quantities = ColumnFlags(arguments.columns, arguments.units).applied(QUANTITIES)
    tests = []
    for file in dict.fromkeys(files):  # a file that is named twice is read once
        for specimen in read_specimens(file, quantities):
            sizes = sizes_of_flags if table is None else {**sizes_of_flags, **table.sizes_of(specimen)}
            geometry, assumptions = shared_geometry or _test_geometry(arguments, sizes)
            tests.append(_CompressionTest(specimen, geometry, assumptions))
    return tests


def _solve_moduli(tests: Sequence[_CompressionTest], *, compression_negative: bool) -> list[CompressionResult]:
    """Return the modulus of each specimen, with notes on the assumptions of its test.

    The force law of each body is solved by finite elements only once, because specimens with the same sizes share it.
    With `compression_negative`, the machine has recorded compression as negative. Raises InputError if a body cannot be
    solved, because its sizes come from the user.
    """
    geometries = list(dict.fromkeys(test.geometry for test in tests))  # the different geometries, for the progress
    results = []
    try:
        with showing_progress("solving the compression of each body") as work:
            for test in tests:
                # The progress is the index of the geometry, because later tests with the same geometry take no time.
                count = _body_counter(work, geometries.index(test.geometry), len(geometries))
                result = measure_modulus(
                    test.specimen, test.geometry, compression_negative=compression_negative, count=count
                )
                results.append(replace(result, notes=(*test.assumptions, *result.notes)))
    except SolveError as error:
        raise InputError(str(error)) from error
    return results


def _body_counter(work: Work, body: int, bodies: int) -> Count:
    """Return a progress callback for the body with index `body`, which counts its parts among the parts of all bodies.

    All bodies are assumed to have equally many parts.
    """
    return lambda ended, parts: work.count(body * parts + ended, bodies * parts)


def _check_plot(path: Path | None) -> None:
    """Raise InputError unless the path of `--plot` is the name of an HTML file, or None."""
    if path is not None and (path.suffix.lower() != ".html" or path.is_dir()):
        bound = "the name of a file that ends in .html, and not a folder"
        raise validation_error("--plot", str(path), "", bound, "write for instance fruit.html")


def _test_geometry(arguments: Namespace, sizes: Sizes) -> tuple[TestGeometry, list[str]]:
    """Return the geometry of a test, and a sentence for each assumption made because a flag is missing.

    `sizes` [mm] are the sizes of the body and of the plunger, by the names of their flags. Raises InputError if a flag
    is missing for which no default exists, or if flags contradict each other.
    """
    assumptions: list[str] = []
    body = _compressed_body(arguments.body, sizes, assumptions)
    plunger = _plunger(arguments.plunger, sizes)
    support = arguments.support
    # A default is assumed only if no flag describes the test.
    if support is None and arguments.body is None and plunger is None:
        support = "plate"
        assumptions.append("no --body and no --plunger: a plate above and a plate below are assumed")
    if support is None:
        raise validation_error("--support", None, "", f"one of {', '.join(SUPPORTS)}", "choose what is under the body")
    area = _plate_area(arguments.plate_area, body, assumptions)
    poisson = _poissons_ratio(arguments.poisson, assumptions)
    compliance_error = _compliance_error(arguments)
    geometry = TestGeometry(
        body=body,
        plunger=plunger,
        plates=1 if support == "seat" else 2,  # a rigid seat fits the body, so it does not flatten it
        poisson=poisson,
        poisson_error=arguments.poisson_error,
        plate_area_mm2=area,
        strains_percent=_parse_strains(arguments.strain),
        compliance_um_per_N=arguments.compliance,
        compliance_error_um_per_N=compliance_error,
    )
    return geometry, assumptions


def _poissons_ratio(given: float | None, assumptions: list[str]) -> float:
    """Return Poisson's ratio [1], and append a sentence to `assumptions` if it is not given."""
    if given is not None:
        return given
    assumptions.append(f"no --poisson: a Poisson's ratio of {POISSON:g} is assumed")
    return POISSON


def _plate_area(given: float | None, body: CompressedBody, assumptions: list[str]) -> float:
    """Return the area of the plate [mm^2], and append a sentence to `assumptions` if the area is not given.

    The default is the area of the end of the body. A body without flat ends, such as a ball, is assumed to be pressed
    by the plate of the paper.
    """
    if given is not None:
        return given
    if body.end_area_mm2:
        area, area_name = body.end_area_mm2, "the area of the end"
    else:
        area, area_name = PAPER_PLATE_MM2, "the area of the paper's plate"
    assumptions.append(f"no --plate-area: {area_name}, {area:.4g} mm^2, is assumed")
    return area


def _compliance_error(arguments: Namespace) -> float:
    """Return the largest error of the machine's compliance [um/N], by default a tenth of the compliance.

    If `--compliance` is not given, the compliance is 0, and so is this default. Raises InputError if the error is given
    without the compliance.
    """
    compliance_error = arguments.compliance_error
    if compliance_error is None:
        return float(_COMPLIANCE_ERROR * arguments.compliance)
    if not arguments.compliance:
        bound = "given together with --compliance"
        raise validation_error("--compliance-error", compliance_error, "um/N", bound, "give both, or neither")
    return float(compliance_error)


def _compressed_body(kind: str | None, sizes: Sizes, assumptions: list[str]) -> CompressedBody:
    """Return the compressed body, and append to `assumptions` a sentence for each size that is not given.

    `kind` is the value of `--body`. If it is None, the body is a ball, or an ellipsoid if a height is given. `sizes`
    [mm] are keyed by the names of their flags. Raises InputError if the kind of body or one of its sizes is missing, or
    if a size is given that such a body does not have.
    """
    if kind is None:
        if "radius" not in sizes:
            raise validation_error("--body", None, "", f"one of {', '.join(BODIES)}", "choose what is pressed")
        kind = "ellipsoid" if "height" in sizes else "ball"
    body_sizes = {name: size for name, size in sizes.items() if name != "plunger_radius"}
    defaults_in_radii = _DEFAULT_SIZES_IN_RADII.get(kind, {})
    _check_sizes(kind, body_sizes, defaults_in_radii)
    for name in sorted(defaults_in_radii.keys() - body_sizes.keys()):
        body_sizes[name] = defaults_in_radii[name] * body_sizes["radius"]
        assumptions.append(f"no {_flag(name)}: {body_sizes[name]:g} mm, as for a ball, is assumed")
    return KINDS[kind](**{f"{name}_mm": size for name, size in body_sizes.items()})


def _check_sizes(kind: str, given: Sizes, defaults: Sizes) -> None:
    """Raise InputError for the first size that is missing, or that a body of this kind does not have.

    `given` and `defaults` are the given and the default sizes of the body, by the names of their flags.
    """
    # The sizes of a body are the fields of its class, which end in "_mm".
    needed = {item.name.removesuffix("_mm") for item in fields(KINDS[kind])}
    missing = needed - given.keys() - defaults.keys()
    superfluous = given.keys() - needed
    wrong_names = sorted(missing | superfluous)
    if wrong_names:
        name = wrong_names[0]
        bound = f"{'given' if name in missing else 'left out'} for --body {kind}"
        raise validation_error(_flag(name), given.get(name), "mm", bound, "give the sizes that this body has")


def _flag(size: str) -> str:
    """Return the flag of a size, such as --radius-across for the size radius_across."""
    return f"--{size.replace('_', '-')}"


def _plunger(end: str | None, sizes: Sizes) -> Plunger | None:
    """Return the plunger that replaces the upper plate, or None if a plate presses the body.

    `end` is the value of `--plunger`, "flat" or "ball", and `sizes` [mm] may hold the radius of the plunger. Raises
    InputError if only one of its two flags is given.
    """
    radius = sizes.get("plunger_radius")
    if end is None and radius is None:
        return None
    if end is None or radius is None:
        missing = "--plunger" if end is None else "--plunger-radius"
        bound = "given together with the other flag of the plunger"
        raise validation_error(missing, None, "", bound, "give --plunger and --plunger-radius, or neither")
    return Plunger(radius_mm=radius, ball=end == "ball")


def _parse_strains(text: str) -> tuple[float, ...]:
    """Convert the text of `--strain` to strains [%]. Raises InputError unless it holds numbers."""
    try:
        return tuple(number(part) for part in text.split(","))
    except ValueError as error:
        hint = "write for instance --strain 5,2,10"
        raise validation_error("--strain", text, "%", "numbers separated by commas", hint) from error
