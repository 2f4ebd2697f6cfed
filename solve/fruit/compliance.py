"""The compliance of the fruit: the indentation under each tip per force on each tip."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from sensor.arrays import Floats
from sensor.design.tips import Tips
from sensor.record import Record
from solve.error_estimate import SolveInfo

ROUND_OFF = 1e-12  # round-off of a ratio of stiffnesses
TIPS = Tips().names  # names of the paper's pair, from -x to +x


@dataclass(frozen=True, eq=False)
class MeshCompliance:
    """Indentation of tip i per force on tip j on one mesh, times E: S [1/mm], shape (tips, tips), and its dofs."""

    S: Floats
    dofs: int


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class SkinTable(Record):
    """Compliance of flesh under a skin: S [1/mm] (n, tips, tips) at rising moduli E [MPa] (n,) of the flesh.

    S is times E. Beyond the ends of the table S is constant: the compliance is again proportional to 1 / E.
    """

    E: Floats
    S: Floats

    def at(self, E: float) -> Floats:
        """Return S [1/mm], (tips, tips), at a modulus of the flesh [MPa], by a cubic spline over ln E."""
        from scipy.interpolate import CubicSpline  # slow to load, and not needed without a skin

        return np.asarray(CubicSpline(np.log(self.E), self.S)(math.log(self.within(E))))

    def within(self, E: float) -> float:
        """Return the modulus in the range of the table nearest to E [MPa]."""
        return min(max(E, float(self.E[0])), float(self.E[-1]))


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class FruitCompliance(Record):
    """Indentation of tip i per force on tip j, times the modulus E: S [1/mm], shape (tips, tips), read-only.

    `tips` has the names of the tips in the order of S, from -x to +x. `error_pair` bounds the relative error [1] of s11
    - s12, which sizes the springs, and `error_own` the relative error of s11. `shape_change` (tips, tips) [1/mm] is the
    part of S that comes from the shape of a curved fruit, 0 for a block. Under a skin, S depends on the modulus of the
    flesh: `at` returns it for the modulus `flesh_E` [MPa], and before that S is for the flesh without the skin. `rough`
    is True if only per cents of accuracy were requested; contact is then solved on few cells.
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
        """Store read-only copies of the matrices; raises ValueError for another number of rows or columns than tips."""
        change = self.shape_change if np.ndim(self.shape_change) else np.zeros(np.shape(self.S))
        for name, matrix in (("S", self.S), ("shape_change", change)):
            copied = np.array(matrix, dtype=np.float64)
            if copied.shape != (len(self.tips), len(self.tips)):
                msg = f"{name} has shape {copied.shape}: must have a row and a column for each of {len(self.tips)} tips"
                raise ValueError(msg)
            copied.flags.writeable = False
            object.__setattr__(self, name, copied)

    def at(self, E: float) -> "FruitCompliance":
        """Return the compliance at a modulus of the flesh [MPa], or the same object if there is no skin."""
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
        """Return the compliance of the pair that represents the tips on low and on high springs, by their indices.

        The displacement of tip i of the pair is the mean over its tips, per force on each tip of j. It is exact if the
        tips of one kind of spring carry equal forces, as in a level square or line. A pair returns itself.
        """
        groups = (list(low), list(high))
        if len(self.tips) == len(groups):
            return self
        skin = self.skin and replace(self.skin, S=np.array([_grouped(S, groups) for S in self.skin.S]))
        return replace(
            self, tips=TIPS, S=_grouped(self.S, groups), shape_change=_grouped(self.shape_change, groups), skin=skin
        )

    def K_m_over_E(self, tip: int = 0) -> float:
        """Return the stiffness of the fruit under a tip over its modulus [mm], K_m / E = 1 / (s_ii - crosstalk)."""
        return 1.0 / (float(self.S[tip, tip]) - self.crosstalk)

    def stiffness_ratio(self, tip: int = -1) -> float:
        """Return the fruit's stiffness under a tip over its stiffness under the first tip [1].

        In the middle of the fruit it is exactly 1, even on a mesh without mirror planes, whose S differs by round-off.
        """
        crosstalk = self.crosstalk
        ratio = (float(self.S[0, 0]) - crosstalk) / (float(self.S[tip, tip]) - crosstalk)
        return 1.0 if abs(ratio - 1.0) <= ROUND_OFF else ratio


def _grouped(S: Floats, groups: Sequence[list[int]]) -> Floats:
    """Return the compliance of groups of tips that carry equal forces, from the compliance of the tips [same unit].

    The entry of two groups is the mean indentation of the tips of the first per force on each tip of the second.
    """
    grouped = np.empty((len(groups), len(groups)))
    for i, rows in enumerate(groups):
        for j, columns in enumerate(groups):
            grouped[i, j] = S[np.ix_(rows, columns)].sum() / len(rows)
    return grouped
