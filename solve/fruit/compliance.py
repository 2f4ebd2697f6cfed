"""The compliance of the fruit: the indentation under each tip per force on each tip, times Young's modulus."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from sensor.arrays import Floats
from sensor.design.tips import Tips
from sensor.record import Record
from solve.error_estimate import SolveInfo

ROUND_OFF = 1e-12  # difference from 1 below which a stiffness ratio is set to 1
TIPS = Tips().names  # names of the two tips in the paper, from -x to +x


@dataclass(frozen=True, eq=False)
class MeshCompliance:
    """The compliance from one mesh: S[i, j] is the indentation under tip i per force on tip j, times E [1/mm].

    `dofs` is the number of degrees of freedom of the mesh.
    """

    S: Floats
    dofs: int


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class SkinTable(Record):
    """The compliance of flesh under a skin, tabulated against the modulus of the flesh.

    S (n, tips, tips) [1/mm] is the indentation per force, times E. E (n,) [MPa] holds increasing moduli of the flesh.
    Beyond the ends of the table, S is constant, so the compliance is proportional to 1 / E.
    """

    E: Floats
    S: Floats

    def at(self, E: float) -> Floats:
        """Return S (tips, tips) [1/mm] at a modulus of the flesh [MPa], from a cubic spline in ln E."""
        from scipy.interpolate import CubicSpline  # slow to load, and needed only for a skin

        return np.asarray(CubicSpline(np.log(self.E), self.S)(math.log(self.within(E))))

    def within(self, E: float) -> float:
        """Return the modulus E [MPa], limited to the range of the table."""
        return min(max(E, float(self.E[0])), float(self.E[-1]))


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class FruitCompliance(Record):
    """The compliance of a fruit under its tips: S[i, j] is the indentation under tip i per force on tip j, times E.

    S (tips, tips) [1/mm] is read-only. `tips` holds the names of the tips in the order of S, from -x to +x.
    `difference_error` bounds the relative error [1] of s11 - s12, from which the springs are sized. `s11_error` bounds
    the relative error of s11. `shape_change` (tips, tips) [1/mm] is the part of S that is due to the shape of a curved
    fruit. For a block, it is 0.

    Under a skin, the compliance depends on the modulus of the flesh. S is then the compliance of the flesh without its
    skin. `at` returns the compliance at one modulus of the flesh, which becomes `flesh_E` [MPa]. `rough` is True if an
    accuracy of a few per cent was requested. Contact is then solved on few cells.
    """

    tips: tuple[str, ...] = TIPS
    S: Floats
    difference_error: float
    s11_error: float
    info: SolveInfo
    shape_change: Floats = field(default_factory=lambda: np.zeros(()))
    skin: SkinTable | None = None
    flesh_E: float | None = None
    rough: bool = False

    def __post_init__(self) -> None:
        """Store read-only copies of both matrices. Raises ValueError unless their shape is (tips, tips)."""
        change = self.shape_change if np.ndim(self.shape_change) else np.zeros(np.shape(self.S))
        for name, matrix in (("S", self.S), ("shape_change", change)):
            copied = np.array(matrix, dtype=np.float64)
            if copied.shape != (len(self.tips), len(self.tips)):
                msg = f"{name} has shape {copied.shape}. It must have a row and a column for each tip."
                raise ValueError(msg)
            copied.flags.writeable = False
            object.__setattr__(self, name, copied)

    def at(self, E: float) -> "FruitCompliance":
        """Return the compliance at a modulus of the flesh [MPa]. Without a skin, it is this object itself."""
        if self.skin is None:
            return self
        return replace(self, S=self.skin.at(E), skin=None, flesh_E=self.skin.within(E))

    @cached_property
    def crosstalk(self) -> float:
        """Return the mean indentation under one tip per force on another, times E [1/mm], or 0 for a single tip."""
        count = len(self.tips)
        if count == 1:
            return 0.0
        off_diagonal = self.S[~np.eye(count, dtype=bool)]
        return float(off_diagonal.sum()) / (count * (count - 1))

    def as_pair(self, low: Sequence[int], high: Sequence[int]) -> "FruitCompliance":
        """Return the compliance of a pair of tips: one for all low springs, and one for all high springs.

        `low` and `high` are the indices of the tips on these springs. An entry of the result is the mean indentation
        under the tips of one group, per force on each tip of the other. The mean is exact if all tips of a group carry
        the same force, as in a level square or line. The compliance of a pair is returned unchanged.
        """
        groups = (list(low), list(high))
        if len(self.tips) == len(groups):  # each group is a single tip
            return self
        skin = self.skin
        if skin is not None:
            grouped_table = [_grouped(S, groups) for S in skin.S]  # one compliance for each modulus of the flesh
            skin = replace(skin, S=np.array(grouped_table))
        return replace(
            self, tips=TIPS, S=_grouped(self.S, groups), shape_change=_grouped(self.shape_change, groups), skin=skin
        )

    def K_m_over_E(self, tip: int = 0) -> float:
        """Return the stiffness of the fruit under a tip per unit modulus, K_m / E = 1 / (s_ii - crosstalk) [mm]."""
        return 1.0 / (float(self.S[tip, tip]) - self.crosstalk)

    def stiffness_ratio(self, tip: int = -1) -> float:
        """Return the stiffness of the fruit under a tip divided by its stiffness under the first tip [1].

        A ratio that differs from 1 only by round-off is set to exactly 1. Such ratios occur on meshes without mirror
        planes.
        """
        crosstalk = self.crosstalk
        ratio = (float(self.S[0, 0]) - crosstalk) / (float(self.S[tip, tip]) - crosstalk)
        return 1.0 if abs(ratio - 1.0) <= ROUND_OFF else ratio


def _grouped(S: Floats, groups: Sequence[list[int]]) -> Floats:
    """Return the compliance of groups of tips that carry equal forces, from the compliance S of the tips.

    An entry is the mean indentation under the tips of one group, per force on each tip of the other.
    """
    grouped = np.empty((len(groups), len(groups)))
    for i, rows in enumerate(groups):
        for j, columns in enumerate(groups):
            grouped[i, j] = S[np.ix_(rows, columns)].sum() / len(rows)
    return grouped
