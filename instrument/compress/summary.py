"""Summary of several compression tests: the moduli of each fruit, and the range of moduli for a design."""

import math
import statistics
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from rich.console import RenderableType

from instrument.compress.modulus import CompressionResult
from instrument.template import template_parts
from sensor.words import next_multiple, rounded

_MODULI = 7  # number of moduli in the list for a design, as in the paper


@dataclass(frozen=True, kw_only=True)
class FruitSummary:
    """The tests of one fruit: their number, and the mean and standard deviation of both moduli [MPa].

    The standard deviation is 0 if there is only one test.
    """

    name: str
    count: int
    E_MPa: float
    E_deviation_MPa: float
    E_plate_MPa: float
    E_plate_deviation_MPa: float


@dataclass(frozen=True, kw_only=True)
class DesignRange:
    """The moduli that a design file requires [MPa]: the largest modulus, and a list that spans the range."""

    E_max_MPa: float
    E_MPa: tuple[float, ...]

    def join_moduli(self, sign: str) -> str:
        """Return the list of moduli as text, separated by `sign`."""
        return sign.join(f"{E:g}" for E in self.E_MPa)


def fruit_summaries(results: Sequence[CompressionResult], *, by_folder: bool) -> list[FruitSummary]:
    """Return one summary for each fruit.

    By default, all specimens in a file are from the same fruit. With `by_folder`, all specimens in a folder are from
    the same fruit.
    """
    tests_of_fruit: dict[str, list[CompressionResult]] = {}
    for result in results:
        path = Path(result.file)
        name = str(path.parent if by_folder else path)
        tests_of_fruit.setdefault(name, []).append(result)
    return [_summarise(name, tests) for name, tests in tests_of_fruit.items()]


def overall_modulus(summaries: Sequence[FruitSummary]) -> FruitSummary:
    """Return the mean and the standard deviation [MPa] over all fruit; each fruit has the same weight."""
    return _summarise("all fruit", summaries)


def _summarise(name: str, tests: Sequence[CompressionResult | FruitSummary]) -> FruitSummary:
    """Summarise tests of one fruit, or the summaries of several fruit, by the mean and deviation of their moduli.

    `name` is the name of the summary. The standard deviation of a single test is 0.
    """
    moduli = [test.E_MPa for test in tests]
    plate_moduli = [test.E_plate_MPa for test in tests]
    has_deviation = len(tests) > 1
    return FruitSummary(
        name=name,
        count=len(tests),
        E_MPa=statistics.fmean(moduli),
        E_deviation_MPa=statistics.stdev(moduli) if has_deviation else 0.0,
        E_plate_MPa=statistics.fmean(plate_moduli),
        E_plate_deviation_MPa=statistics.stdev(plate_moduli) if has_deviation else 0.0,
    )


def find_design_range(results: Sequence[CompressionResult]) -> DesignRange:
    """Return the range of moduli for a design file, which covers the error bars of all results.

    The ends are rounded outwards to two significant digits. For a single specimen, the list contains only its modulus,
    and only `E_max_MPa` covers its error bar.
    """
    E = np.array([test.E_MPa for test in results])
    u = 0.01 * np.array([test.u_percent for test in results])  # half widths of the error bars, relative to E
    # `next_multiple` rounds to two digits, up towards infinity or down towards 0. Its results are `rounded` only at the
    # end: their round-off decides how the list rounds a modulus halfway between two digits.
    E_max = next_multiple(float((E * (1.0 + u)).max()), 2, math.inf)
    E_min = next_multiple(float((E * (1.0 - u)).min()), 2, 0.0)
    moduli = E if len(results) == 1 else np.linspace(E_min, E_max, _MODULI)
    return DesignRange(E_max_MPa=rounded(E_max), E_MPa=tuple(rounded(modulus) for modulus in moduli))


def result_parts(
    results: Sequence[CompressionResult], fruit: Sequence[FruitSummary], design: DesignRange
) -> list[RenderableType]:
    """Return the answer for the terminal: tables of specimens and fruit, notes, and the modulus range for a design.

    `fruit` are the summaries of the fruit, and `design` is the range of moduli from `find_design_range`.
    """
    largest_shares: dict[str, float] = {}  # largest share of each cause in an error [%]
    for result in results:
        for cause, share in result.shares_percent.items():
            largest_shares[cause] = max(share, largest_shares.get(cause, 0.0))
    notes_once = dict.fromkeys(note for result in results for note in result.notes)
    return template_parts(
        "compress/modulus.txt.j2",
        results=results,
        shares=largest_shares,
        # Change of the modulus per mm of every radius or width, for the body with the largest change.
        per_mm_percent=max(100.0 * result.geometry.body.per_mm for result in results),
        # Whether a machine is assumed to be rigid.
        rigid=any(result.geometry.compliance_um_per_N == 0.0 for result in results),
        summaries=[*fruit, overall_modulus(fruit)],
        design=design,
        notes=notes_once,
    )
