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

_MODULI = 7  # length of the list for a design, as in the paper


@dataclass(frozen=True, kw_only=True)
class FruitSummary:
    """The tests of one fruit: their number, and the mean and standard deviation of each modulus [MPa].

    The deviation of a single test is 0.
    """

    name: str
    count: int
    E_MPa: float
    E_deviation_MPa: float
    E_plate_MPa: float
    E_plate_deviation_MPa: float


@dataclass(frozen=True, kw_only=True)
class DesignRange:
    """The moduli that a design file requires [MPa]: the largest one, and a list over the range."""

    E_max_MPa: float
    E_MPa: tuple[float, ...]

    def join_moduli(self, sign: str) -> str:
        """Return the moduli as text with a separator."""
        return sign.join(f"{E:g}" for E in self.E_MPa)


def fruit_summaries(results: Sequence[CompressionResult], *, by_folder: bool) -> list[FruitSummary]:
    """Return one summary for each fruit.

    All specimens of a file belong to one fruit, or `by_folder` all files of a folder.
    """
    tests_of_fruit: dict[str, list[CompressionResult]] = {}
    for result in results:
        path = Path(result.file)
        tests_of_fruit.setdefault(str(path.parent if by_folder else path), []).append(result)
    return [_summarise(name, tests) for name, tests in tests_of_fruit.items()]


def overall_modulus(summaries: Sequence[FruitSummary]) -> FruitSummary:
    """Return the mean and the standard deviation [MPa] over all fruit, each counted once."""
    return _summarise("all fruit", summaries)


def _summarise(name: str, tests: Sequence[CompressionResult | FruitSummary]) -> FruitSummary:
    """Return the means and standard deviations of tests, or of the means of fruit; `name` is the summary's name."""
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
    """Return the range of moduli for a design file, which contains all error bars of the results.

    The ends are rounded outwards to two digits. For one specimen the list contains only its modulus.
    """
    E = np.array([test.E_MPa for test in results])
    u = 0.01 * np.array([test.u_percent for test in results])
    # The ends are products whose last bits are kept. These decide how a modulus half way between two digits is rounded.
    E_max = next_multiple(float((E * (1.0 + u)).max()), 2, math.inf)
    E_min = next_multiple(float((E * (1.0 - u)).min()), 2, 0.0)
    moduli = E if len(results) == 1 else np.linspace(E_min, E_max, _MODULI)
    return DesignRange(E_max_MPa=rounded(E_max), E_MPa=tuple(rounded(modulus) for modulus in moduli))


def result_parts(
    results: Sequence[CompressionResult], fruit: Sequence[FruitSummary], design: DesignRange
) -> list[RenderableType]:
    """Return the answer for the terminal: tables of the specimens and fruit, notes, and the range for a design."""
    shares: dict[str, float] = {}  # the largest part of the error by each cause
    for result in results:
        shares |= {name: max(share, shares.get(name, 0.0)) for name, share in result.shares_percent.items()}
    return template_parts(
        "compress/modulus.txt.j2",
        results=results,
        shares=shares,
        per_mm_percent=max(100.0 * result.geometry.body.per_mm for result in results),
        rigid=any(result.geometry.compliance_um_per_N == 0.0 for result in results),
        summaries=[*fruit, overall_modulus(fruit)],
        design=design,
        notes=dict.fromkeys(note for result in results for note in result.notes),
    )
