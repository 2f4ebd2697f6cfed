"""The compliance of the fruit: how far it is indented under each tip per force on each tip."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from sensor.arrays import Floats
from sensor.design.tips import Tips
from sensor.record import Record
from solve.error_estimate import SolveInfo

ROUND_OFF = 1e-12  # of a ratio of stiffnesses
TIPS = Tips().names  # of the paper's pair, from -x to +x


@dataclass(frozen=True, eq=False)
class MeshCompliance:
    """Indentation of tip i per force on tip j on one mesh, times E: S [1/mm], shape (tips, tips), and its dofs."""

    S: Floats
    dofs: int


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class SkinTable(Record):
    """Compliance of flesh under a skin at moduli of the flesh: E [MPa], rising, shape (n,), S [1/mm] (n, tips, tips).

    S is times E. Beyond the table it is that at its end: there the fruit is proportional to E again.
    """

    E: Floats
    S: Floats

    def at(self, E: float) -> Floats:
        """Return S [1/mm], shape (tips, tips), at a modulus of the flesh [MPa], by a cubic spline over ln E."""
        from scipy.interpolate import CubicSpline  # a reading of flesh without a skin is told without it

        return np.asarray(CubicSpline(np.log(self.E), self.S)(math.log(self.within(E))))

    def within(self, E: float) -> float:
        """Return the modulus of the table that is nearest to another [MPa]."""
        return min(max(E, float(self.E[0])), float(self.E[-1]))


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class FruitCompliance(Record):
    """Indentation of tip i per force on tip j, times the modulus E: S [1/mm], shape (tips, tips), read-only.

    `tips` names the tips in the order of S, from -x to +x. `error_pair` bounds s11 - s12 (the number that sizes the
    springs) and `error_own` bounds s11, both relative to the value [1]. `shape_change` is what the shape of a curved
    fruit adds to S of its equivalent block [1/mm], shape (tips, tips). S holds it. It is zero for a block. A fruit with
    a skin has another S at each modulus of its flesh. `at` gives it, of that `flesh_E` [MPa]. S is that of the flesh
    alone where there is none. `rough` says that percents were asked for: contact follows on few cells.
    """

    tips: tuple[str, ...] = TIPS
    S: Floats
    error_pair: float
    error_own: float
    info: SolveInfo
    shape_change: Floats = field(default_factory=lambda: np.zeros(()))
    skin: SkinTable | None = None
    flesh_E: float | None = None
    rough: bool = False

    def __post_init__(self) -> None:
        """Take read-only copies of the matrices; raise ValueError unless they have a row and a column for each tip."""
        change = self.shape_change if np.ndim(self.shape_change) else np.zeros(np.shape(self.S))
        for name, matrix in (("S", self.S), ("shape_change", change)):
            copied = np.array(matrix, dtype=np.float64)
            if copied.shape != (len(self.tips), len(self.tips)):
                msg = f"{name} has shape {copied.shape}: must have a row and a column for each of {len(self.tips)} tips"
                raise ValueError(msg)
            copied.flags.writeable = False
            object.__setattr__(self, name, copied)

    def at(self, E: float) -> "FruitCompliance":
        """Return the compliance at a modulus of the flesh [MPa]: itself where no skin lies on it."""
        if self.skin is None:
            return self
        return replace(self, S=self.skin.at(E), skin=None, flesh_E=self.skin.within(E))

    @cached_property
    def crosstalk(self) -> float:
        """Return the mean indentation of one tip per force on another, times E [1/mm]; 0 for a single tip."""
        count = len(self.tips)
        if count == 1:
            return 0.0
        between = self.S[~np.eye(count, dtype=bool)]
        return float(between.sum()) / (count * (count - 1))

    def per_spring(self, low: Sequence[int], high: Sequence[int]) -> "FruitCompliance":
        """Return the compliance of the pair that stands for the tips on low and on high springs, by their indices.

        Tip i of the pair sinks as the mean of its tips, per force on each tip of j. It is exact where the tips of one
        spring carry equal forces, as in a level square or line. A pair is its own.
        """
        groups = (list(low), list(high))
        if len(self.tips) == len(groups):
            return self
        skin = self.skin and replace(self.skin, S=np.array([_grouped(S, groups) for S in self.skin.S]))
        return replace(
            self, tips=TIPS, S=_grouped(self.S, groups), shape_change=_grouped(self.shape_change, groups), skin=skin
        )

    def K_m_over_E(self, tip: int = 0) -> float:
        """Return the stiffness of the fruit under a tip over its modulus [mm]: K_m / E = 1 / (s_ii - crosstalk)."""
        return 1.0 / (float(self.S[tip, tip]) - self.crosstalk)

    def stiffness_ratio(self, tip: int = -1) -> float:
        """Return the fruit's stiffness under a tip over that under the first tip [1]; 1 in the middle of the fruit.

        There it is 1 to the bit, also on a mesh without mirror planes, whose entries of S differ by round-off.
        """
        crosstalk = self.crosstalk
        ratio = (float(self.S[0, 0]) - crosstalk) / (float(self.S[tip, tip]) - crosstalk)
        return 1.0 if abs(ratio - 1.0) <= ROUND_OFF else ratio


def _grouped(S: Floats, groups: Sequence[list[int]]) -> Floats:
    """Return the compliance of groups of tips that carry equal forces, from that of the tips [same unit].

    The entry of two groups is the mean indentation of the tips of the first per force on each tip of the second.
    """
    grouped = np.empty((len(groups), len(groups)))
    for i, rows in enumerate(groups):
        for j, columns in enumerate(groups):
            grouped[i, j] = S[np.ix_(rows, columns)].sum() / len(rows)
    return grouped
