"""Several compression tests together: each fruit, the range for a design, and all of it as tables and as data."""

import math
import statistics
import sys
from collections.abc import Callable, Iterable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from pipeline.measure.compression.force_law import TestGeometry
from pipeline.measure.compression.modulus import CompressionResult

_MODULI = 7  # in the design's list, as in the paper's
_WIDTH = 132
_ONE_MM = 1.0
_SOME_POISSON = 0.05


@dataclass(frozen=True, kw_only=True)
class FruitSummary:
    """The tests of one fruit: their number, mean and standard deviation [MPa] of each modulus, 0 for a single one."""

    name: str
    count: int
    E_hertz_MPa: float
    E_hertz_deviation_MPa: float
    E_plate_MPa: float
    E_plate_deviation_MPa: float


@dataclass(frozen=True, kw_only=True)
class DesignRange:
    """The moduli that a design file asks for [MPa]: the largest, and a list over the range."""

    E_max_MPa: float
    E_MPa: tuple[float, ...]

    @property
    def flags(self) -> str:
        """Return the range as flags of `pipeline run`."""
        moduli = ",".join(f"{value:g}" for value in self.E_MPa)
        return f"--set fruit.E_max_MPa={self.E_max_MPa:g} --set fruit.E_MPa=[{moduli}]"

    @property
    def toml(self) -> str:
        """Return the range as lines of a design file."""
        moduli = ", ".join(f"{value:g}" for value in self.E_MPa)
        return f"[fruit]\nE_max_MPa = {self.E_max_MPa:g}\nE_MPa = [{moduli}]"


def fruit_summaries(results: Sequence[CompressionResult], *, by_folder: bool) -> list[FruitSummary]:
    """Return one summary for each file, whose specimens are tests of one fruit, or for each folder of such files."""
    groups: dict[str, list[CompressionResult]] = {}
    for result in results:
        path = Path(result.specimen.file)
        groups.setdefault(str(path.parent if by_folder else path), []).append(result)
    summaries = []
    for name, group in groups.items():
        summaries.append(_summary(name, [test.E_hertz_MPa for test in group], [test.E_plate_MPa for test in group]))
    return summaries


def overall(summaries: Sequence[FruitSummary]) -> FruitSummary:
    """Return mean and standard deviation [MPa] over the fruit, each counted once."""
    return _summary("all fruit", [fruit.E_hertz_MPa for fruit in summaries], [fruit.E_plate_MPa for fruit in summaries])


def _summary(name: str, hertz: Sequence[float], plate: Sequence[float]) -> FruitSummary:
    several = len(hertz) > 1
    return FruitSummary(
        name=name,
        count=len(hertz),
        E_hertz_MPa=statistics.fmean(hertz),
        E_hertz_deviation_MPa=statistics.stdev(hertz) if several else 0.0,
        E_plate_MPa=statistics.fmean(plate),
        E_plate_deviation_MPa=statistics.stdev(plate) if several else 0.0,
    )


def design_range(results: Iterable[CompressionResult]) -> DesignRange:
    """Return the range from the softest to the stiffest Hertz modulus, each with its error bar, rounded outwards.

    Of one specimen it is that modulus alone.
    """
    tests = list(results)
    highest = _rounded(max(test.E_hertz_MPa * (1.0 + 0.01 * test.u_percent) for test in tests), math.ceil)
    if len(tests) == 1:
        return DesignRange(E_max_MPa=highest, E_MPa=(float(f"{tests[0].E_hertz_MPa:.3g}"),))
    lowest = _rounded(min(test.E_hertz_MPa * (1.0 - min(0.01 * test.u_percent, 0.9)) for test in tests), math.floor)
    steps = [lowest + (highest - lowest) * index / (_MODULI - 1) for index in range(_MODULI)]
    return DesignRange(E_max_MPa=highest, E_MPa=tuple(float(f"{value:.3g}") for value in steps))


def _rounded(value: float, towards: Callable[[float], int]) -> float:
    """Return a positive value with two digits, rounded by math.floor or math.ceil [same unit]."""
    unit = 10.0 ** (math.floor(math.log10(value)) - 1)
    return float(f"{towards(round(value / unit, 9)) * unit:.3g}")


def result_mapping(result: CompressionResult, assumed: Sequence[str]) -> dict[str, object]:
    """Return one specimen's numbers, their units in the keys; `assumed` says what the flags left open."""
    chosen = result.chosen
    geometry = asdict(result.geometry)
    geometry.pop("strains_percent")
    return {
        "file": result.specimen.file,
        "specimen": result.specimen.name,
        "E_hertz_MPa": result.E_hertz_MPa,
        "E_over_1_minus_nu2_MPa": result.E_hertz_MPa / (1.0 - result.geometry.poisson**2),
        "E_plate_MPa": result.E_plate_MPa,
        "u_percent": result.u_percent,
        "u_plate_percent": result.secants[0].u_secant_percent,
        "plate_reads_low_by": result.reads_low,
        "first_touch_mm": chosen.touch.value,
        "force_rises_from_mm": chosen.fit.onset,
        "range_end_mm": chosen.last,
        "failure_mm": result.curve.failure,
        "zero_N": chosen.fit.offset,
        "drift_N_per_mm": chosen.fit.drift.value,
        "noise_N": result.curve.noise,
        "follows_hertz": chosen.follows,
        "at_strain": [asdict(secant) for secant in result.secants],
        "geometry": geometry,
        "notes": [*assumed, *result.notes],
    }


def print_results(
    results: Sequence[CompressionResult], fruit: Sequence[FruitSummary], design: DesignRange, assumed: Sequence[str]
) -> None:
    """Print each specimen, each fruit as in the paper's Table I, and the range for the design file."""
    console = Console(width=None if sys.stdout.isatty() else _WIDTH)
    names = [escape(f"{Path(result.specimen.file).name} {result.specimen.name}") for result in results]
    console.print(_specimen_table(results, names))
    console.print(_strain_table(results, names))
    if len(results) > 1:
        console.print(_fruit_table(fruit))
    notes = [*assumed]
    for result in results:
        notes += result.notes
    lines = [f"note: {escape(note)}" for note in dict.fromkeys(notes)]
    lines += [_warning(results), _left_out(results[0].geometry)]
    lines.append(f"for the design file:\n{escape(design.toml)}\nor: pipeline run {escape(design.flags)}")
    for line in lines:
        console.print(line, highlight=False)


def _table(title: str, heads: Sequence[str]) -> Table:
    table = Table(title=title, title_justify="left")
    for index, head in enumerate(heads):
        table.add_column(head, justify="right" if index else "left")
    return table


def _specimen_table(results: Sequence[CompressionResult], names: Sequence[str]) -> Table:
    heads = ["specimen", "E, Hertz [MPa]", "± [%]", "E, plate [MPa]", "± [%]", "plate reads low by"]
    heads += ["first touch [mm]", "range to [mm]", "failure [mm]"]
    table = _table("modulus of each specimen, errors at 95 %", heads)
    for result, name in zip(results, names, strict=True):
        failure = result.curve.failure
        table.add_row(
            name,
            f"{result.E_hertz_MPa:.4g}",
            f"{result.u_percent:.2g}",
            f"{result.E_plate_MPa:.4g}",
            f"{result.secants[0].u_secant_percent:.2g}",
            f"{result.reads_low:.2f}",
            f"{result.chosen.touch.value:.3f}",
            f"{result.chosen.last:.2f}",
            "none" if failure is None else f"{failure:.2f}",
        )
    return table


def _strain_table(results: Sequence[CompressionResult], names: Sequence[str]) -> Table:
    heads = ["specimen", "strain [%]", "secant [MPa]", "± [%]", "tangent [MPa]", "± [%]"]
    table = _table("force / plate area over travel / height, errors at 95 %", heads)
    for result, name in zip(results, names, strict=True):
        for secant in result.secants:
            table.add_row(
                name,
                f"{secant.strain_percent:g}",
                f"{secant.E_secant_MPa:.4g}",
                f"{secant.u_secant_percent:.2g}",
                f"{secant.E_tangent_MPa:.4g}",
                f"{secant.u_tangent_percent:.2g}",
            )
    return table


def _fruit_table(summaries: Sequence[FruitSummary]) -> Table:
    title = "modulus of each fruit, mean ± standard deviation [MPa], as in the paper's Table I"
    table = _table(title, ["fruit", "tests", "E, Hertz", "E, plate"])
    for fruit in (*summaries, overall(summaries)):
        hertz = f"{fruit.E_hertz_MPa:.3g}"
        plate = f"{fruit.E_plate_MPa:.3g}"
        if fruit.count > 1:
            hertz += f" ± {fruit.E_hertz_deviation_MPa:.2g}"
            plate += f" ± {fruit.E_plate_deviation_MPa:.2g}"
        table.add_row(escape(fruit.name), f"{fruit.count}", hertz, plate)
    return table


def _warning(results: Sequence[CompressionResult]) -> str:
    lowest = min(result.reads_low for result in results)
    highest = max(result.reads_low for result in results)
    factor = f"{highest:.2f}" if f"{lowest:.2f}" == f"{highest:.2f}" else f"{lowest:.2f} to {highest:.2f}"
    here = f"here it reads {factor} times low" if lowest >= 1.0 else f"here Hertz's modulus is {factor} times it"
    return (
        f"warning: force / plate area over travel / height, as in the paper, is no modulus of a convex fruit: {here}. "
        "Design with Hertz's."
    )


def _left_out(geometry: TestGeometry) -> str:
    radius = 50.0 * _ONE_MM / geometry.radius_mm
    poisson = 200.0 * abs(geometry.poisson) * _SOME_POISSON / (1.0 - geometry.poisson**2)
    return (
        f"not in the error bar: {_ONE_MM:g} mm of both radii moves E by {radius:.2g} %, {_SOME_POISSON:g} of Poisson's "
        f"ratio by {poisson:.2g} % (E / (1 - nu^2), which a sensor reads, not at all)"
    )
