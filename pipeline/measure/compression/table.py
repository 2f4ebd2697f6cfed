"""The answer of `pipeline modulus`: tables for a reader, plain data for a program."""

import sys
from collections.abc import Sequence
from pathlib import Path

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from pipeline.measure.compression.batch import DesignRange, FruitSummary, overall
from pipeline.measure.compression.modulus import CompressionResult, TestGeometry

_WIDTH = 132
_ONE_MM, _SOME_POISSON = 1.0, 0.05


def result_mapping(result: CompressionResult, assumed: Sequence[str]) -> dict[str, object]:
    """Return one specimen's numbers, their units in the keys; `assumed` says what the flags left open."""
    chosen, curve, geometry = result.chosen, result.curve, result.geometry
    return {
        "file": result.specimen.file,
        "specimen": result.specimen.name,
        "E_hertz_MPa": result.E_hertz_MPa,
        "E_over_1_minus_nu2_MPa": result.E_hertz_MPa / (1.0 - geometry.poisson**2),
        "E_plate_MPa": result.E_plate_MPa,
        "u_percent": result.u_percent,
        "u_plate_percent": result.secants[0].u_secant_percent,
        "plate_reads_low_by": result.reads_low,
        "first_touch_mm": chosen.touch,
        "force_rises_from_mm": chosen.fit.onset,
        "range_end_mm": chosen.last,
        "failure_mm": curve.failure,
        "zero_N": chosen.fit.offset,
        "drift_N_per_mm": chosen.fit.drift,
        "noise_N": curve.noise,
        "follows_hertz": chosen.follows,
        "at_strain": [
            {
                "strain_percent": one.strain_percent,
                "E_secant_MPa": one.E_secant_MPa,
                "u_secant_percent": one.u_secant_percent,
                "E_tangent_MPa": one.E_tangent_MPa,
                "u_tangent_percent": one.u_tangent_percent,
            }
            for one in result.secants
        ],
        "geometry": {
            "height_mm": geometry.height_mm,
            "radius_mm": geometry.radius_mm,
            "radius_across_mm": geometry.radius_across_mm,
            "poisson": geometry.poisson,
            "plate_area_mm2": geometry.plate_area_mm2,
            "plates": geometry.plates,
        },
        "notes": [*assumed, *result.notes],
    }


def print_results(
    results: Sequence[CompressionResult], fruit: Sequence[FruitSummary], design: DesignRange, assumed: Sequence[str]
) -> None:
    """Print each specimen, each fruit as in the paper's Table I, and the range for the design file."""
    console = Console(width=None if sys.stdout.isatty() else _WIDTH)
    console.print(_specimens(results))
    console.print(_strains(results))
    if len(results) > 1:
        console.print(_fruit(fruit))
    for note in dict.fromkeys([*assumed, *(note for result in results for note in result.notes)]):
        console.print(f"note: {escape(note)}", highlight=False)
    for line in (*_warning(results), *_left_out(results[0].geometry)):
        console.print(line, highlight=False)
    console.print(
        f"for the design file:\n{escape(design.toml)}\nor: pipeline run {escape(design.flags)}", highlight=False
    )


def _specimens(results: Sequence[CompressionResult]) -> Table:
    table = Table(title="modulus of each specimen, errors at 95 %", title_justify="left")
    heads = ("specimen", "E, Hertz [MPa]", "± [%]", "E, plate [MPa]", "± [%]", "plate reads low by")
    for head in (*heads, "first touch [mm]", "range to [mm]", "failure [mm]"):
        table.add_column(head, justify="left" if head == "specimen" else "right")
    for one, name in zip(results, _names(results), strict=True):
        table.add_row(
            name,
            f"{one.E_hertz_MPa:.4g}",
            f"{one.u_percent:.2g}",
            f"{one.E_plate_MPa:.4g}",
            f"{one.secants[0].u_secant_percent:.2g}",
            f"{one.reads_low:.2f}",
            f"{one.chosen.touch:.3f}",
            f"{one.chosen.last:.2f}",
            "none" if one.curve.failure is None else f"{one.curve.failure:.2f}",
        )
    return table


def _names(results: Sequence[CompressionResult]) -> list[str]:
    """Return a name for each specimen, with the file's folder only where its name alone is not enough."""
    files = {result.specimen.file for result in results}
    short = len({Path(file).name for file in files}) == len(files)
    shown = [Path(one.specimen.file).name if short else one.specimen.file for one in results]
    return [escape(f"{file} {one.specimen.name}") for file, one in zip(shown, results, strict=True)]


def _strains(results: Sequence[CompressionResult]) -> Table:
    title = "force / plate area over travel / height, errors at 95 %"
    table = Table(title=title, title_justify="left")
    for head in ("specimen", "strain [%]", "secant [MPa]", "± [%]", "tangent [MPa]", "± [%]"):
        table.add_column(head, justify="left" if head == "specimen" else "right")
    for result, name in zip(results, _names(results), strict=True):
        for one in result.secants:
            table.add_row(
                name,
                f"{one.strain_percent:g}",
                f"{one.E_secant_MPa:.4g}",
                f"{one.u_secant_percent:.2g}",
                f"{one.E_tangent_MPa:.4g}",
                f"{one.u_tangent_percent:.2g}",
            )
    return table


def _fruit(fruit: Sequence[FruitSummary]) -> Table:
    title = "modulus of each fruit, mean ± standard deviation [MPa], as in the paper's Table I"
    table = Table(title=title, title_justify="left")
    for head in ("fruit", "tests", "E, Hertz", "E, plate"):
        table.add_column(head, justify="left" if head == "fruit" else "right")
    for one in (*fruit, overall(fruit)):
        hertz, plate = f"{one.E_hertz_MPa:.3g}", f"{one.E_plate_MPa:.3g}"
        if one.count > 1:
            hertz += f" ± {one.E_hertz_deviation_MPa:.2g}"
            plate += f" ± {one.E_plate_deviation_MPa:.2g}"
        table.add_row(escape(one.name), f"{one.count}", hertz, plate)
    return table


def _warning(results: Sequence[CompressionResult]) -> list[str]:
    least, most = min(one.reads_low for one in results), max(one.reads_low for one in results)
    factor = f"{most:.2f}" if f"{least:.2f}" == f"{most:.2f}" else f"{least:.2f} to {most:.2f}"
    here = f"here it reads {factor} times low" if least >= 1.0 else f"here Hertz's modulus is {factor} times it"
    return [
        f"warning: force / plate area over travel / height, as in the paper, is no modulus of a convex fruit: {here}. "
        "Design with Hertz's."
    ]


def _left_out(geometry: TestGeometry) -> list[str]:
    radius = 50.0 * _ONE_MM / geometry.radius_mm
    poisson = 200.0 * abs(geometry.poisson) * _SOME_POISSON / (1.0 - geometry.poisson**2)
    return [
        f"not in the error bar: {_ONE_MM:g} mm of both radii moves E by {radius:.2g} %, {_SOME_POISSON:g} of Poisson's "
        f"ratio by {poisson:.2g} % (E / (1 - nu^2), which a sensor reads, not at all)"
    ]
