"""A level sensor of two springs whose tips go deep: what it shows, and what the linear law reads from that.

The fruit under a tip carries K_m g(d) d, and its spring K (x - d). d is the indentation and g the factor of large
strain at d over the tip's side. Lengths in mm, forces in N.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

from sensor.design.fruit import Fruit
from sensor.design.tips import Tips
from sensor.theory.bisection import last_holding
from sensor.theory.soft_tissue import FLESH_LAWS, FleshLawName, large_strain_factor
from sensor.theory.two_spring_law import PAPER_SPRINGS, Springs, force_ratio, fruit_stiffness
from solve.fruit.split import split_compliance


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
            flesh = K_m * float(large_strain_factor(depth / self.side, self.poisson, self.law)) * depth
            return flesh < K * (travel - depth)

        return last_holding(spring_bears_more, 0.0, travel)


POISSONS = (0.3, 0.4, 0.45, 0.49)
FIRST, TRAVELS = 0.06, (0.1, 0.3, 0.6)  # [mm]


def accuracy_rows() -> Iterator[str]:
    """Yield the rows of the table in docs/measurements.md: what large strain does to the paper's press on 1 MPa.

    For each Poisson's ratio and law: P, linear and large at both ends of the travel, its change, and the error of E.
    """
    for poisson in POISSONS:
        K_m = split_compliance(Fruit(poisson=poisson), Tips(), 1e-3).K_m_over_E()
        linear = force_ratio(PAPER_SPRINGS, K_m)
        press = DeepPress(springs=PAPER_SPRINGS, side=1.0, poisson=poisson)
        for law in FLESH_LAWS:
            deep = replace(press, law=law)
            ratios = [f"{deep.ratio(K_m, travel):.3f}" for travel in (FIRST, TRAVELS[-1])]
            drift = f"{100.0 * deep.drift(K_m, (FIRST, TRAVELS[-1])):+.1f} %"
            biases = [f"{100.0 * deep.bias(K_m, travel):+.1f} %" for travel in TRAVELS]
            cells = [f"{poisson:g}", law, f"{linear:.3f}", *ratios, "0", drift, "0", *biases]
            yield f"| {' | '.join(cells)} |"
