"""From targets and the fruit's answer to the two spring stiffnesses, by the law that also judges them."""

from dataclasses import dataclass

from cad.design.parameters import Design
from cad.quantity import fault
from cad.theory.two_spring_law import Springs, hayes_stiffness, series_stiffness, size_springs
from solve.fruit.compliance import Compliance


@dataclass(frozen=True, kw_only=True)
class Sizing:
    """The springs a design asks for and the fruit stiffness that sized them [N/mm; K_m / E in mm].

    `K_m_max` and `sized_asymmetry` sized the springs. `K_m_max_contact` and `asymmetry`, of the two tips, are those of
    the true contact, which judges whatever sized; `K_m_top` is at the largest modulus shown, which may lie beyond.
    """

    springs: Springs
    K_m_over_E: float
    K_m_max: float
    K_m_max_contact: float
    K_m_top: float
    asymmetry: float
    sized_asymmetry: float
    fruit_stiffness: str

    def deflections(self, travels_mm: tuple[float, float]) -> tuple[float, float]:
        """Return how far the low and the high spring give on the stiffest fruit [mm] at the full travel of each tip."""
        low, high = (
            max(0.0, travel) * series_stiffness(K, K_m) / K
            for travel, K, K_m in zip(
                travels_mm,
                (self.springs.K_l, self.springs.K_h),
                (self.K_m_top, self.asymmetry * self.K_m_top),
                strict=True,
            )
        )
        return low, high


def size(design: Design, contact: Compliance, fruit_stiffness: str) -> Sizing:
    """Return the springs that meet the targets, or those that the design gives, with the fruit stiffness used.

    "contact" takes K_m = E / (s11 - s12); "hayes" the paper's circular tip, whose radius is half the side.
    """
    fruit, tips, targets = design.fruit, design.tips, design.targets
    by_hayes = hayes_stiffness(1.0, fruit.poisson, 0.5 * tips.side_mm)
    K_m_over_E = by_hayes if fruit_stiffness == "hayes" else contact.K_m_over_E_mm
    sized = 1.0 if fruit_stiffness == "hayes" else contact.asymmetry
    K_m_max = fruit.E_max_MPa * K_m_over_E
    given = design.springs
    if given.K_l_N_per_m is not None and given.K_h_N_per_m is not None:
        springs = Springs(K_l=1e-3 * given.K_l_N_per_m, K_h=1e-3 * given.K_h_N_per_m)
    else:
        if targets.P_max <= sized:
            bound = f"greater than {sized:.4g}, the ratio of the fruit under the two tips"
            raise fault("targets.P_max", targets.P_max, "1", bound, "bring the tips to the middle of the fruit")
        springs = size_springs(targets.P_max, targets.NL, K_m_max, targets.NL_definition, sized)
    return Sizing(
        springs=springs,
        K_m_over_E=K_m_over_E,
        K_m_max=K_m_max,
        K_m_max_contact=fruit.E_max_MPa * contact.K_m_over_E_mm,
        K_m_top=max(fruit.E_max_MPa, *fruit.E_MPa) * contact.K_m_over_E_mm,
        asymmetry=contact.asymmetry,
        sized_asymmetry=sized,
        fruit_stiffness=fruit_stiffness,
    )
