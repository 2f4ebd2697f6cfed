"""The ten mangoes of the paper's Table I on this sensor: what P they show, and which of them it can tell apart."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cad.design.mango_tests import MANGO_TESTS, CompressedMango
from pipeline.report.page.fields import Floats
from pipeline.report.stored import StoredReport


@dataclass(frozen=True, kw_only=True)
class SeenMango:
    """A mango of Table I with the force ratio P that it shows [1], and the moduli that may show the same P [MPa].

    None where the sensor has no reading; a bound is infinite where the springs set none.
    """

    mango: CompressedMango
    P: float
    printed: tuple[float, float] | None
    calibrated: tuple[float, float] | None


@dataclass(frozen=True, kw_only=True)
class ToldApart:
    """How many pairs of mangoes a sensor can tell apart with one error bar, and the numbers of those it cannot."""

    pairs: int
    told: int
    alike: tuple[tuple[int, int], ...]


def seen_mangoes(report: StoredReport) -> tuple[SeenMango, ...]:
    """Return the mangoes of Table I as this sensor sees them at full travel [MPa], those in its range of moduli."""
    curve = report.curve
    E, P = numbers(curve.E_MPa), numbers(curve.P)
    printed = (numbers(curve.E_lower_as_printed_MPa), numbers(curve.E_upper_as_printed_MPa))
    calibrated = (numbers(curve.E_lower_calibrated_MPa), numbers(curve.E_upper_calibrated_MPa))
    found = []
    for mango in MANGO_TESTS.mangoes:
        ratio = float(np.interp(mango.E_MPa, E, P))
        if E[0] <= mango.E_MPa <= E[-1] and np.isfinite(ratio):
            bars = (_bar(mango.E_MPa, E, band) for band in (printed, calibrated))
            as_printed, after = bars
            found.append(SeenMango(mango=mango, P=ratio, printed=as_printed, calibrated=after))
    return tuple(found)


def numbers(values: Sequence[float | None]) -> Floats:
    """Return numbers of a report as an array of the same length and unit, shape (n,); nan for None."""
    return np.array([np.nan if value is None else value for value in values], dtype=np.float64)


def _bar(modulus: float, E: Floats, band: tuple[Floats, Floats]) -> tuple[float, float] | None:
    """Return the band at a modulus [MPa]; where the upper end of all is missing there is no bound."""
    lower, upper = (float(np.interp(modulus, E, end)) for end in band)
    if np.isnan(lower) and np.isnan(upper):
        return None
    return (0.0 if np.isnan(lower) else lower), (np.inf if np.isnan(upper) else upper)


def told_apart(bars: Sequence[tuple[int, tuple[float, float] | None]]) -> ToldApart:
    """Return which pairs of mangoes, by number and error bar [MPa], have bars that do not meet."""
    pairs = [(a, b) for place, a in enumerate(bars) for b in bars[place + 1 :]]
    alike = tuple((a[0], b[0]) for a, b in pairs if a[1] is None or b[1] is None or _meet(a[1], b[1]))
    return ToldApart(pairs=len(pairs), told=len(pairs) - len(alike), alike=alike)


def _meet(a: tuple[float, float], b: tuple[float, float]) -> bool:
    return a[0] <= b[1] and b[0] <= a[1]
