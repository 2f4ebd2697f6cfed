"""Several compression tests together: each fruit, and the range for a design, as tables and as data."""

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
    """The tests of one fruit: their number, and mean and standard deviation of each modulus [MPa], 0 for one test."""

    name: str
    count: int
    E_MPa: float
    E_deviation_MPa: float
    E_plate_MPa: float
    E_plate_deviation_MPa: float


@dataclass(frozen=True, kw_only=True)
class DesignRange:
    """The moduli that a design file requires [MPa]: the largest, and a list over the range."""

    E_max_MPa: float
    E_MPa: tuple[float, ...]

    def join_moduli(self, sign: str) -> str:
        """Return the moduli as text with a separator."""
        return sign.join(f"{E:g}" for E in self.E_MPa)


def fruit_summaries(results: Sequence[CompressionResult], *, by_folder: bool) -> list[FruitSummary]:
    """Return one summary for each file, whose specimens are of one fruit, or for each folder of such files."""
    tests_of: dict[str, list[CompressionResult]] = {}
    for result in results:
        path = Path(result.file)
        tests_of.setdefault(str(path.parent if by_folder else path), []).append(result)
    return [_summary(name, tests) for name, tests in tests_of.items()]


def overall_modulus(summaries: Sequence[FruitSummary]) -> FruitSummary:
    """Return mean and standard deviation [MPa] over all fruits, each counted once."""
    return _summary("all fruit", summaries)


def _summary(name: str, tests: Sequence[CompressionResult | FruitSummary]) -> FruitSummary:
    """Return the means and standard deviations of tests, or of fruits, under a name."""
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
    """Return the range from the softest to the stiffest modulus with their error bars, rounded outwards.

    For one specimen the list contains only its modulus.
    """
    E = np.array([test.E_MPa for test in results])
    u = 0.01 * np.array([test.u_percent for test in results])
    # The ends keep the last bits of a product, by which a modulus half way between two numbers is rounded below.
    E_max = next_multiple(float((E * (1.0 + u)).max()), 2, math.inf)
    E_min = next_multiple(float((E * (1.0 - u)).min()), 2, 0.0)
    moduli = E if len(results) == 1 else np.linspace(E_min, E_max, _MODULI)
    return DesignRange(E_max_MPa=rounded(E_max), E_MPa=tuple(rounded(modulus) for modulus in moduli))


def result_parts(
    results: Sequence[CompressionResult], fruit: Sequence[FruitSummary], design: DesignRange
) -> list[RenderableType]:
    """Return the text of each specimen, of each fruit as in the paper's Table I, and of the range for a design."""
    shares: dict[str, float] = {}
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
