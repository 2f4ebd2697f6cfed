"""A level sensor of two springs whose tips go deep: what it shows, and what the linear law reads from that.

The fruit under a tip carries K_m g(d) d, with d the indentation and g the factor of large strain at d over the tip's
side, and its spring K (x - d). Lengths in mm, forces in N.
"""

from dataclasses import dataclass

from cad.theory.bisection import last_holding
from cad.theory.soft_tissue import FleshLawName, large_strain_factor
from cad.theory.two_spring_law import Springs, fruit_stiffness


@dataclass(frozen=True, kw_only=True)
class DeepPress:
    """Two springs under tips of a side [mm] on flesh of a Poisson's ratio [1] and a law."""

    springs: Springs
    side: float
    poisson: float
    law: FleshLawName = "neo-hooke"

    def force(self, K: float, K_m: float, travel: float) -> float:
        """Return the force of a tip on a spring K and a fruit K_m [N/mm], at a travel [mm]."""
        return K * (travel - self._depth(K, K_m, travel))

    def ratio(self, K_m: float, travel: float) -> float:
        """Return P [1] on a fruit of stiffness K_m [N/mm] at a travel [mm]."""
        soft, stiff = (self.force(K, K_m, travel) for K in self.springs.stiffnesses)
        return stiff / soft

    def drift(self, K_m: float, travels: tuple[float, ...]) -> float:
        """Return P at the last travel over P at the first, less 1 [1]; travels in mm."""
        return self.ratio(K_m, travels[-1]) / self.ratio(K_m, travels[0]) - 1.0

    def bias(self, K_m: float, travel: float) -> float:
        """Return how far the linear law (4) reads E off from P at a travel [mm], as a share of E [1].

        Raises ValueError where P is out of the range that the springs can show.
        """
        return fruit_stiffness(self.springs, self.ratio(K_m, travel)) / K_m - 1.0

    def _depth(self, K: float, K_m: float, travel: float) -> float:
        """Return the indentation [mm] at which spring and fruit carry the same."""

        def spring_bears_more(depth: float) -> bool:
            flesh = K_m * large_strain_factor(depth / self.side, self.poisson, self.law) * depth
            return flesh < K * (travel - depth)

        return last_holding(spring_bears_more, 0.0, travel)
