"""From targets and the fruit's answer to the two spring stiffnesses, by the law that also judges them."""

from dataclasses import dataclass

from cad.parameters import Design
from cad.springs import Springs, hayes_stiffness, series_stiffness, size_springs
from solve.compliance import Compliance


@dataclass(frozen=True, kw_only=True)
class Sizing:
    """The springs a design asks for and the fruit stiffness that sized them [N/mm; K_m / E in mm].

    `K_m_max_contact` is the largest fruit stiffness under the true contact, which judges whatever sized.
    """

    springs: Springs
    K_m_over_E: float
    K_m_max: float
    K_m_max_contact: float
    fruit_stiffness: str

    def deflections(self, travel_mm: float) -> tuple[float, float]:
        """Return how far the low and the high spring give at full travel on the stiffest fruit [mm]."""
        K_m = self.K_m_max_contact
        low, high = (travel_mm * series_stiffness(K, K_m) / K for K in (self.springs.K_l, self.springs.K_h))
        return low, high


def size(design: Design, contact: Compliance, fruit_stiffness: str) -> Sizing:
    """Return the springs that meet the targets, or those that the design gives, with the fruit stiffness used.

    "contact" takes K_m = E / (s11 - s12); "hayes" the paper's circular tip, whose radius is half the side.
    """
    fruit, tips, targets = design.fruit, design.tips, design.targets
    by_hayes = hayes_stiffness(1.0, fruit.poisson, 0.5 * tips.side_mm)
    K_m_over_E = by_hayes if fruit_stiffness == "hayes" else contact.K_m_over_E_mm
    K_m_max = fruit.E_max_MPa * K_m_over_E
    given = design.springs
    if given.K_l_N_per_m is not None and given.K_h_N_per_m is not None:
        springs = Springs(K_l=1e-3 * given.K_l_N_per_m, K_h=1e-3 * given.K_h_N_per_m)
    else:
        springs = size_springs(targets.P_max, targets.NL, K_m_max, targets.NL_definition)
    return Sizing(
        springs=springs,
        K_m_over_E=K_m_over_E,
        K_m_max=K_m_max,
        K_m_max_contact=fruit.E_max_MPa * contact.K_m_over_E_mm,
        fruit_stiffness=fruit_stiffness,
    )
