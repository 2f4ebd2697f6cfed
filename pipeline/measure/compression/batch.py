"""Several compression tests together: mean and scatter of each fruit, and the range that a sensor shall cover."""

import math
import statistics
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from pipeline.measure.compression.modulus import CompressionResult

_MODULI = 7  # in the design's list, as in the paper's


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
        return f"--set fruit.E_max_MPa={self.E_max_MPa:g} --set fruit.E_MPa={self._list()}"

    @property
    def toml(self) -> str:
        """Return the range as lines of a design file."""
        return f"[fruit]\nE_max_MPa = {self.E_max_MPa:g}\nE_MPa = {self._list().replace(',', ', ')}"

    def _list(self) -> str:
        return "[" + ",".join(f"{value:g}" for value in self.E_MPa) + "]"


def fruit_summaries(results: Sequence[CompressionResult], *, by_folder: bool) -> list[FruitSummary]:
    """Return one summary for each file, whose specimens are tests of one fruit, or for each folder of such files."""
    groups: dict[str, list[CompressionResult]] = {}
    for result in results:
        path = Path(result.specimen.file)
        groups.setdefault(str(path.parent if by_folder else path), []).append(result)
    return [_summary(name, group) for name, group in groups.items()]


def overall(summaries: Sequence[FruitSummary]) -> FruitSummary:
    """Return mean and standard deviation [MPa] over the fruit, each counted once."""
    hertz, plate = [one.E_hertz_MPa for one in summaries], [one.E_plate_MPa for one in summaries]
    return _of("all fruit", hertz, plate)


def design_range(results: Iterable[CompressionResult]) -> DesignRange:
    """Return the range from the softest to the stiffest Hertz modulus, each with its error bar, rounded outwards.

    Of one specimen it is that modulus alone.
    """
    known = list(results)
    if len(known) == 1:
        (one,) = known
        most = _rounded(one.E_hertz_MPa * (1.0 + 0.01 * one.u_percent), math.ceil)
        return DesignRange(E_max_MPa=most, E_MPa=(float(f"{one.E_hertz_MPa:.3g}"),))
    least = min(one.E_hertz_MPa * (1.0 - min(0.01 * one.u_percent, 0.9)) for one in known)
    most = max(one.E_hertz_MPa * (1.0 + 0.01 * one.u_percent) for one in known)
    least, most = _rounded(least, math.floor), _rounded(most, math.ceil)
    steps = [least + (most - least) * index / (_MODULI - 1) for index in range(_MODULI)]
    return DesignRange(E_max_MPa=most, E_MPa=tuple(float(f"{value:.3g}") for value in steps))


def _summary(name: str, group: Sequence[CompressionResult]) -> FruitSummary:
    return _of(name, [one.E_hertz_MPa for one in group], [one.E_plate_MPa for one in group])


def _of(name: str, hertz: Sequence[float], plate: Sequence[float]) -> FruitSummary:
    several = len(hertz) > 1
    return FruitSummary(
        name=name,
        count=len(hertz),
        E_hertz_MPa=statistics.fmean(hertz),
        E_hertz_deviation_MPa=statistics.stdev(hertz) if several else 0.0,
        E_plate_MPa=statistics.fmean(plate),
        E_plate_deviation_MPa=statistics.stdev(plate) if several else 0.0,
    )


def _rounded(value: float, towards: Callable[[float], int]) -> float:
    """Return a positive value with two digits, rounded by math.floor or math.ceil [same unit]."""
    place = 10.0 ** (math.floor(math.log10(value)) - 1)
    return float(f"{towards(round(value / place, 9)) * place:.3g}")
