"""The ten mangoes of the paper's Table I on this sensor: what P they show, and which of them are resolvable."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import NamedTuple

import numpy as np

from pipeline.report.report import Report
from sensor.arrays import Floats
from sensor.design.mango_tests import MANGOES, CompressedMango


class ModulusBar(NamedTuple):
    """The moduli that may show the same P [MPa]; from 0 or to infinity where the springs set no bound."""

    low: float
    high: float


@dataclass(frozen=True, kw_only=True)
class SeenMango:
    """A mango of Table I with the force ratio P that it shows [1], and its error bars, None without a reading."""

    mango: CompressedMango
    P: float
    printed: ModulusBar | None
    calibrated: ModulusBar | None


def seen_mangoes(report: Report) -> tuple[SeenMango, ...]:
    """Return the mangoes of Table I as this sensor sees them at full travel, those in its range of moduli."""
    curve = report.curve
    E = numbers(curve.E_MPa)
    P = numbers(curve.P)
    seen = []
    for mango in MANGOES:
        ratio = float(np.interp(mango.E_MPa, E, P))
        if E[0] <= mango.E_MPa <= E[-1] and math.isfinite(ratio):
            printed = _bar(mango.E_MPa, E, curve.E_lower_as_printed_MPa, curve.E_upper_as_printed_MPa)
            calibrated = _bar(mango.E_MPa, E, curve.E_lower_calibrated_MPa, curve.E_upper_calibrated_MPa)
            seen.append(SeenMango(mango=mango, P=ratio, printed=printed, calibrated=calibrated))
    return tuple(seen)


def numbers(values: Sequence[float | None]) -> Floats:
    """Return numbers of a report as an array of the same length and unit, shape (n,); nan for None."""
    return np.array(values, dtype=np.float64)


def _bar(modulus: float, E: Floats, lower: Sequence[float | None], upper: Sequence[float | None]) -> ModulusBar | None:
    """Return the band at a modulus [MPa]."""
    low = float(np.interp(modulus, E, numbers(lower)))
    high = float(np.interp(modulus, E, numbers(upper)))
    if math.isnan(low) and math.isnan(high):
        return None
    return ModulusBar(low=0.0 if math.isnan(low) else max(low, 0.0), high=math.inf if math.isnan(high) else high)


def alike_pairs(bars: Sequence[ModulusBar | None]) -> list[tuple[int, int]]:
    """Return the pairs, by their indices, whose error bars meet or are unknown: the sensor cannot tell them apart."""
    pairs = []
    for (i, first), (j, second) in combinations(enumerate(bars), 2):
        if first is None or second is None or (first.low <= second.high and second.low <= first.high):
            pairs.append((i, j))
    return pairs
