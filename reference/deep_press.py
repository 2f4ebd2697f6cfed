"""A level sensor with two springs at deep indentation: its force ratio, and the error of the linear law.

The force of the fruit on a tip is K_m g(d / s) d, and the force of the tip's spring is K (x - d). Here d is the
indentation, x the travel, s the side of the tip, and g the factor of large strain. The two forces are equal, which
determines d. Lengths are in mm and forces in N.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

from sensor.design.fruit import Fruit
from sensor.design.tips import Tips
from sensor.theory.bisection import end_of_true_range
from sensor.theory.soft_tissue import FLESH_LAWS, FleshLawName, large_strain_factor
from sensor.theory.two_spring_law import PAPER_SPRINGS, Springs, force_ratio, fruit_stiffness
from solve.fruit.split import split_compliance


@dataclass(frozen=True, kw_only=True)
class DeepPress:
    """Two springs whose square tips have this `side` [mm], pressed on flesh that follows a large-strain law."""

    springs: Springs
    side: float
    poisson: float
    law: FleshLawName = "neo-hooke"

    def force(self, K: float, K_m: float, travel: float) -> float:
        """Return the force on a tip [N] at a travel [mm].

        K is the stiffness of its spring, and K_m the stiffness of the fruit under it [N/mm].
        """
        return K * (travel - self._depth(K, K_m, travel))

    def ratio(self, K_m: float, travel: float) -> float:
        """Return the force ratio P [1] at a travel [mm] on a fruit of stiffness K_m [N/mm].

        P is the force on the stiff spring divided by the force on the soft spring.
        """
        soft, stiff = (self.force(K, K_m, travel) for K in self.springs.stiffnesses)
        return stiff / soft

    def drift(self, K_m: float, travels: tuple[float, ...]) -> float:
        """Return the relative change of P [1] from the first to the last of the travels [mm]."""
        return self.ratio(K_m, travels[-1]) / self.ratio(K_m, travels[0]) - 1.0

    def bias(self, K_m: float, travel: float) -> float:
        """Return the relative error of E [1] if E is computed from P at a travel [mm] by equation (4) of the paper.

        This equation is linear in the indentation. Raises ValueError if P is outside the range of the springs.
        """
        return fruit_stiffness(self.springs, self.ratio(K_m, travel)) / K_m - 1.0

    def _depth(self, K: float, K_m: float, travel: float) -> float:
        """Return the indentation [mm] at which the forces of the spring and the fruit are equal, by bisection.

        K is the stiffness of the spring, and K_m the stiffness of the fruit [N/mm]. The indentation is between 0 and
        the travel [mm].
        """

        def is_spring_force_larger(depth: float) -> bool:
            """Return whether the spring pushes harder than the fruit at an indentation, so that the tip sinks in."""
            fruit_force = K_m * float(large_strain_factor(depth / self.side, self.poisson, self.law)) * depth
            return fruit_force < K * (travel - depth)

        return end_of_true_range(is_spring_force_larger, 0.0, travel)


POISSONS = (0.3, 0.4, 0.45, 0.49)
FIRST = 0.06  # first travel of the press, at which the indentation is still small [mm]
TRAVELS = (0.1, 0.3, 0.6)  # travels at which the error of E is stated [mm]


def accuracy_rows() -> Iterator[str]:
    """Yield the rows of the table on large strain in docs/measurements.md, for the paper's press at 1 MPa.

    The cells of a row are:

    - Poisson's ratio and the name of the large-strain law
    - P according to the linear law, and P at the first and the last travel according to the large-strain law
    - the change of P between these travels according to the linear law, which is 0, and to the large-strain law
    - the error of E according to the linear law, which is 0, and the errors at each of `TRAVELS`
    """
    for poisson in POISSONS:
        K_m = split_compliance(Fruit(poisson=poisson), Tips(), 1e-3).K_m_over_E()
        linear_ratio = force_ratio(PAPER_SPRINGS, K_m)
        press = DeepPress(springs=PAPER_SPRINGS, side=1.0, poisson=poisson)
        for law in FLESH_LAWS:
            deep_press = replace(press, law=law)
            ratios = [f"{deep_press.ratio(K_m, travel):.3f}" for travel in (FIRST, TRAVELS[-1])]
            drift = f"{100.0 * deep_press.drift(K_m, (FIRST, TRAVELS[-1])):+.1f} %"
            biases = [f"{100.0 * deep_press.bias(K_m, travel):+.1f} %" for travel in TRAVELS]
            linear_drift = linear_bias = "0"  # by the linear law, P does not change, and E has no error
            cells = [f"{poisson:g}", law, f"{linear_ratio:.3f}", *ratios, linear_drift, drift, linear_bias, *biases]
            yield f"| {' | '.join(cells)} |"
