"""Several compression tests together: each fruit, the range for a design, and all of it as tables and as data."""

import math
import statistics
import sys
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from pipeline.measure.compression.force_law import TestGeometry
from pipeline.measure.compression.holds import HeldRelaxation
from pipeline.measure.compression.modulus import CompressionResult

_MODULI = 7  # in the design's list, as in the paper's
_WIDTH = 132
_ONE_MM = 1.0
_MOST_ERROR = 0.9  # of a modulus, that the range goes below it


@dataclass(frozen=True, kw_only=True)
class FruitSummary:
    """The tests of one fruit: their number, mean and standard deviation [MPa] of each modulus, 0 for a single one."""

    name: str
    count: int
    E_MPa: float
    E_deviation_MPa: float
    E_plate_MPa: float
    E_plate_deviation_MPa: float


@dataclass(frozen=True, kw_only=True)
class DesignRange:
    """The moduli that a design file asks for [MPa]: the largest, and a list over the range."""

    E_max_MPa: float
    E_MPa: tuple[float, ...]


def fruit_summaries(results: Sequence[CompressionResult], *, by_folder: bool) -> list[FruitSummary]:
    """Return one summary for each file, whose specimens are tests of one fruit, or for each folder of such files."""
    tests_of: dict[str, list[CompressionResult]] = {}
    for result in results:
        path = Path(result.specimen.file)
        tests_of.setdefault(str(path.parent if by_folder else path), []).append(result)
    return [_summary(name, tests) for name, tests in tests_of.items()]


def overall(summaries: Sequence[FruitSummary]) -> FruitSummary:
    """Return mean and standard deviation [MPa] over the fruit, each counted once."""
    return _summary("all fruit", summaries)


def _summary(name: str, tests: Sequence[CompressionResult | FruitSummary]) -> FruitSummary:
    flesh = [test.E_MPa for test in tests]
    plate = [test.E_plate_MPa for test in tests]
    return FruitSummary(
        name=name,
        count=len(tests),
        E_MPa=statistics.fmean(flesh),
        E_deviation_MPa=statistics.stdev(flesh) if len(tests) > 1 else 0.0,
        E_plate_MPa=statistics.fmean(plate),
        E_plate_deviation_MPa=statistics.stdev(plate) if len(tests) > 1 else 0.0,
    )


def design_range(results: Sequence[CompressionResult]) -> DesignRange:
    """Return the range from the softest to the stiffest modulus, each with its error bar, rounded outwards.

    Of one specimen it is that modulus alone.
    """
    E = np.array([test.E_MPa for test in results])
    u = 0.01 * np.array([test.u_percent for test in results])
    highest = float((E * (1.0 + u)).max())
    step = _second_digit(highest)
    E_max = step * math.ceil(round(highest / step, 9))
    lowest = float((E * (1.0 - np.minimum(u, _MOST_ERROR))).min())
    step = _second_digit(lowest)
    E_min = step * math.floor(round(lowest / step, 9))
    moduli = E if len(results) == 1 else np.linspace(E_min, E_max, _MODULI)
    return DesignRange(E_max_MPa=float(f"{E_max:.3g}"), E_MPa=tuple(float(f"{modulus:.3g}") for modulus in moduli))


def _second_digit(value: float) -> float:
    """Return what one step of the second digit of a positive value is worth [same unit]."""
    return 10.0 ** (math.floor(math.log10(value)) - 1)


def result_mapping(result: CompressionResult, assumed: Sequence[str]) -> dict[str, object]:
    """Return one specimen's numbers, their units in the keys; `assumed` says what the flags left open."""
    chosen = result.chosen
    test = result.geometry
    geometry = {
        **vars(test.body),
        "poisson": test.poisson,
        "plate_area_mm2": test.plate_area_mm2,
        "plates": test.plates,
        "poisson_error": test.poisson_error,
        "body": test.body.kind,
        "plunger": None if test.plunger is None else asdict(test.plunger),
    }
    return {
        "file": result.specimen.file,
        "specimen": result.specimen.name,
        "E_MPa": result.E_MPa,
        "E_hertz_MPa": result.E_hertz_MPa,
        "E_over_1_minus_nu2_MPa": result.E_MPa / (1.0 - result.geometry.poisson**2),
        "E_plate_MPa": result.E_plate_MPa,
        "u_percent": result.u_percent,
        "u_shares_percent": dict(result.shares_percent),
        "u_plate_percent": result.secants[0].u_secant_percent,
        "plate_reads_low_by": result.reads_low,
        "first_touch_mm": chosen.touch.value,
        "force_rises_from_mm": chosen.fit.onset,
        "range_end_mm": chosen.last,
        "failure_mm": result.curve.failure,
        "zero_N": chosen.fit.parameters.offset,
        "drift_N_per_mm": chosen.fit.parameters.drift,
        "noise_N": result.curve.noise,
        "follows_law": chosen.follows,
        "follows_hertz": result.follows_hertz,
        "at_strain": [asdict(secant) for secant in result.secants],
        "geometry": geometry,
        "notes": [*assumed, *result.notes],
        **({} if result.relaxation is None else {"relaxation": _relaxation_mapping(result.relaxation)}),
    }


def _relaxation_mapping(relaxation: HeldRelaxation) -> dict[str, object]:
    arms = []
    for arm in relaxation.arms:
        arms.append(
            {
                "share": arm.share.value,
                "u_share_percent": arm.share.percent,
                "time_s": arm.time.value,
                "u_time_percent": arm.time.percent,
            }
        )
    return {"arms": arms, "hold_s": relaxation.hold_s, "lost_in_loading_percent": 100.0 * relaxation.lost_in_loading}


def print_results(
    results: Sequence[CompressionResult], fruit: Sequence[FruitSummary], design: DesignRange, assumed: Sequence[str]
) -> None:
    """Print each specimen, each fruit as in the paper's Table I, and the range for the design file."""
    console = Console(width=None if sys.stdout.isatty() else _WIDTH)
    console.print(_specimen_table(results))
    console.print(_strain_table(results))
    if len(results) > 1:
        console.print(_fruit_table(fruit))
    notes = list(assumed)
    for result in results:
        notes += result.notes
    for note in dict.fromkeys(notes):
        console.print(f"note: {escape(note)}", highlight=False)
    for line in (_warning(results), _shares(results), _left_out(results[0].geometry)):
        console.print(line, highlight=False)
    for result in results:
        if result.relaxation is not None:
            console.print(f"{_name(result)}: {escape(_relaxation(result.relaxation))}", highlight=False)
    moduli = ", ".join(f"{E:g}" for E in design.E_MPa)
    E_max = f"{design.E_max_MPa:g}"
    toml = f"[fruit]\nE_max_MPa = {E_max}\nE_MPa = [{moduli}]"
    flags = f"--set fruit.E_max_MPa={E_max} --set fruit.E_MPa=[{moduli.replace(' ', '')}]"
    console.print(f"for the design file:\n{escape(toml)}\nor: pipeline run {escape(flags)}", highlight=False)


def _relaxation(relaxation: HeldRelaxation) -> str:
    """Return what a hold tells in words, its arms as the key of a design file."""
    held = f"a hold of {relaxation.hold_s:.3g} s"
    if not relaxation.arms:
        return f"{held} shows no relaxation beyond its noise"
    arms = ", ".join(f"[{arm.share.value:.3g}, {arm.time.value:.3g}]" for arm in relaxation.arms)
    widest = max(max(arm.share.percent, arm.time.percent) for arm in relaxation.arms)
    lost = 100.0 * relaxation.lost_in_loading
    return (
        f"fruit.relaxation = [{arms}], each within {widest:.2g} %, by {held}; {lost:.2g} % of the force at the first "
        "instant were lost in the loading, by up to which E is low"
    )


def _table(title: str, heads: str, rows: Sequence[Sequence[str]]) -> Table:
    """Return a table; its heads are parted by bars."""
    table = Table(title=title, title_justify="left")
    for index, head in enumerate(heads.split(" | ")):
        table.add_column(head, justify="right" if index else "left")
    for row in rows:
        table.add_row(*row)
    return table


def _name(result: CompressionResult) -> str:
    return escape(f"{Path(result.specimen.file).name} {result.specimen.name}")


def _specimen_table(results: Sequence[CompressionResult]) -> Table:
    heads = "specimen | E [MPa] | ± [%] | apparent, Hertz [MPa] | E, plate [MPa] | ± [%] | plate reads low by"
    heads += " | first touch [mm] | range to [mm] | failure [mm]"
    rows = []
    for result in results:
        failure = result.curve.failure
        rows.append(
            [
                _name(result),
                f"{result.E_MPa:.4g}",
                f"{result.u_percent:.2g}",
                "none" if result.E_hertz_MPa is None else f"{result.E_hertz_MPa:.4g}",
                f"{result.E_plate_MPa:.4g}",
                f"{result.secants[0].u_secant_percent:.2g}",
                f"{result.reads_low:.2f}",
                f"{result.chosen.touch.value:.3f}",
                f"{result.chosen.last:.2f}",
                "none" if failure is None else f"{failure:.2f}",
            ]
        )
    return _table("modulus of each specimen, errors at 95 %", heads, rows)


def _strain_table(results: Sequence[CompressionResult]) -> Table:
    rows = []
    for result in results:
        for secant in result.secants:
            rows.append(
                [
                    _name(result),
                    f"{secant.strain_percent:g}",
                    f"{secant.E_secant_MPa:.4g}",
                    f"{secant.u_secant_percent:.2g}",
                    f"{secant.E_tangent_MPa:.4g}",
                    f"{secant.u_tangent_percent:.2g}",
                ]
            )
    heads = "specimen | strain [%] | secant [MPa] | ± [%] | tangent [MPa] | ± [%]"
    return _table("force / plate area over travel / height, errors at 95 %", heads, rows)


def _fruit_table(summaries: Sequence[FruitSummary]) -> Table:
    rows = []
    for fruit in (*summaries, overall(summaries)):
        flesh = f"{fruit.E_MPa:.3g}"
        plate = f"{fruit.E_plate_MPa:.3g}"
        if fruit.count > 1:
            flesh += f" ± {fruit.E_deviation_MPa:.2g}"
            plate += f" ± {fruit.E_plate_deviation_MPa:.2g}"
        rows.append([escape(fruit.name), f"{fruit.count}", flesh, plate])
    title = "modulus of each fruit, mean ± standard deviation [MPa], as in the paper's Table I"
    return _table(title, "fruit | tests | E | E, plate", rows)


def _warning(results: Sequence[CompressionResult]) -> str:
    lowest = min(result.reads_low for result in results)
    highest = max(result.reads_low for result in results)
    factor = f"{highest:.2f}" if f"{lowest:.2f}" == f"{highest:.2f}" else f"{lowest:.2f} to {highest:.2f}"
    here = f"here it reads {factor} times low" if lowest >= 1.0 else f"here E is {factor} times it"
    return (
        f"warning: force / plate area over travel / height, as in the paper, is no modulus of a convex fruit: {here}. "
        "Hertz's law takes the fruit for two half-spaces and reads high. Design with E."
    )


def _shares(results: Sequence[CompressionResult]) -> str:
    """Return what the error bar is made of, each part at its largest over the specimens."""
    names = results[0].shares_percent
    parts = [f"{name} {max(result.shares_percent[name] for result in results):.2g} %" for name in names]
    return f"in the error bar: {', '.join(parts)}"


def _left_out(test: TestGeometry) -> str:
    """Return what the error bar does not hold."""
    by_size = 100.0 * _ONE_MM * test.body.per_mm
    return (
        f"not in the error bar: {_ONE_MM:g} mm of every radius or width moves E by {by_size:.2g} %; flesh that relaxes "
        "while it is pressed"
    )
