"""P over the fruit's stiffness for two springs: the largest force ratio and the nonlinearity, with their errors."""

import math
from collections.abc import Callable
from dataclasses import dataclass

from cad.design.parameters import Targets
from cad.quantity import Estimate
from cad.theory.two_spring_law import (
    Springs,
    force_ratio,
    fruit_stiffness,
    nonlinearity,
    stiffness_at_largest_nonlinearity,
)
from pipeline.springs.sizing import SpringSizing
from solve.error_estimate import propagated
from solve.fruit.compliance import FruitCompliance

Law = Callable[[Springs, float, float], float]


@dataclass(frozen=True, kw_only=True)
class Characteristic:
    """P over the fruit's stiffness: the springs and the largest fruit stiffness they meet [N/mm], each with its error.

    `stiffness_ratio` [1] is the fruit's stiffness under the high tip over that under the low one.
    """

    springs: Springs
    K_m_max: float
    spring_errors: tuple[float, ...] = (0.0, 0.0)
    K_m_error: float = 0.0
    stiffness_ratio: float = 1.0

    def P_max(self) -> Estimate:
        """Return the largest force ratio [1]."""
        return self._estimate(force_ratio)

    def NL(self, targets: Targets) -> Estimate:
        """Return the nonlinearity [1] by the definition of the targets."""
        return self._estimate(lambda springs, K_m, ratio: nonlinearity(springs, K_m, targets.NL_definition, ratio))

    def K_m_of_NL(self, targets: Targets) -> float:
        """Return the fruit stiffness at which the definition of the targets takes the nonlinearity [N/mm]."""
        if targets.NL_definition == "mid-range":
            return 0.5 * self.K_m_max
        return stiffness_at_largest_nonlinearity(self.springs.K_h / self.stiffness_ratio, self.K_m_max)

    def fruit_stiffness(self, P: float) -> float:
        """Return the fruit stiffness at which P is shown [N/mm], (4); 0 below all, infinite beyond the springs."""
        if self.stiffness_ratio >= P:
            return 0.0
        if self.springs.K_h / self.springs.K_l <= P:
            return math.inf
        return fruit_stiffness(self.springs, P, self.stiffness_ratio)

    def _estimate(self, law: Law) -> Estimate:
        values = (*self.springs.stiffnesses, self.K_m_max, self.stiffness_ratio)
        # In the middle of the fruit both tips meet the same stiffness, and no error of a solve parts them.
        share = 0.0 if self.stiffness_ratio == 1.0 else self.K_m_error / self.K_m_max
        errors = (*self.spring_errors, self.K_m_error, share * self.stiffness_ratio)

        def value(K_l: float, K_h: float, K_m: float, ratio: float) -> float:
            return law(Springs(K_l=K_l, K_h=K_h), K_m, ratio)

        return Estimate(value(*values), propagated(value, values, errors))


def characteristic(
    contact: FruitCompliance, sizing: SpringSizing, springs: Springs, errors: tuple[float, ...] = (0.0, 0.0)
) -> Characteristic:
    """Return springs with their errors [N/mm] against the stiffest fruit under the true contact."""
    K_m = sizing.K_m_max_contact
    return Characteristic(
        springs=springs,
        K_m_max=K_m,
        spring_errors=errors,
        K_m_error=contact.error_pair * K_m,
        stiffness_ratio=sizing.stiffness_ratio,
    )
